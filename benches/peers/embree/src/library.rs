//! As much of Embree 4's interface as is used here, by its documentation; the wheel brings no headers.

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::ptr::null_mut;
use std::time::Instant;

/// Rays in a packet.
pub const LANES: usize = 16;

/// `RTCRayHit`.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
pub struct RayHit {
    pub origin: [f32; 3],
    pub near: f32,
    pub direction: [f32; 3],
    pub time: f32,
    pub far: f32,
    pub mask: u32,
    pub id: u32,
    pub flags: u32,
    pub normal: [f32; 3],
    pub uv: [f32; 2],
    pub triangle: u32,
    pub geometry: u32,
    /// Of instances, by level; longer than any configuration's.
    pub instance: [u32; 8],
}

/// `RTCRayHit16`.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
pub struct RayHit16 {
    pub origin: [[f32; LANES]; 3],
    pub near: [f32; LANES],
    pub direction: [[f32; LANES]; 3],
    pub time: [f32; LANES],
    pub far: [f32; LANES],
    pub mask: [u32; LANES],
    pub id: [u32; LANES],
    pub flags: [u32; LANES],
    pub normal: [[f32; LANES]; 3],
    pub uv: [[f32; LANES]; 2],
    pub triangle: [u32; LANES],
    pub geometry: [u32; LANES],
    pub instance: [[u32; LANES]; 8],
}

/// The int of each lane that says whether it has a ray (−1) or not (0).
#[repr(C, align(64))]
pub struct Valid(pub [c_int; LANES]);

impl RayHit {
    /// One ray of a packet.
    #[inline]
    pub fn of(rays: &RayHit16, lane: usize) -> Self {
        Self {
            origin: rays.origin.map(|row| row[lane]),
            near: 0.0,
            direction: rays.direction.map(|row| row[lane]),
            time: 0.0,
            far: rays.far[lane],
            mask: u32::MAX,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            uv: [0.0; 2],
            triangle: NOTHING,
            geometry: NOTHING,
            instance: [NOTHING; 8],
        }
    }
}

/// A packet of rays that count up to `limit`; a lane whose limit is −∞ has none.
pub fn packet(origin: &[[f32; LANES]; 3], direction: &[[f32; LANES]; 3], limit: &[f32; LANES]) -> (Valid, RayHit16) {
    let zero = [0.0; LANES];
    let rays = RayHit16 {
        origin: *origin,
        near: zero,
        direction: *direction,
        time: zero,
        far: *limit,
        mask: [u32::MAX; LANES],
        id: [0; LANES],
        flags: [0; LANES],
        normal: [zero; 3],
        uv: [zero; 2],
        triangle: [NOTHING; LANES],
        geometry: [NOTHING; LANES],
        instance: [[NOTHING; LANES]; 8],
    };
    (Valid(limit.map(|t| if t > 0.0 { -1 } else { 0 })), rays)
}

/// `RTCIntersectArguments` and `RTCOccludedArguments`, with room for what a configuration may add.
#[repr(C)]
struct Arguments {
    flags: c_uint,
    features: c_int,
    context: *mut c_void,
    filter: *mut c_void,
    intersect: *mut c_void,
    more: [usize; 4],
}

/// `RTC_RAY_QUERY_FLAG_COHERENT`.
const COHERENT: c_uint = 1 << 16;
/// `RTC_INVALID_GEOMETRY_ID`.
pub const NOTHING: u32 = u32::MAX;

unsafe extern "C" {
    fn rtcNewDevice(settings: *const c_char) -> *mut c_void;
    fn rtcGetDeviceError(device: *mut c_void) -> c_int;
    fn rtcGetDeviceProperty(device: *mut c_void, property: c_int) -> isize;
    fn rtcNewScene(device: *mut c_void) -> *mut c_void;
    fn rtcReleaseScene(scene: *mut c_void);
    fn rtcNewGeometry(device: *mut c_void, kind: c_int) -> *mut c_void;
    fn rtcSetNewGeometryBuffer(
        geometry: *mut c_void,
        buffer: c_int,
        slot: c_uint,
        format: c_int,
        stride: usize,
        count: usize,
    ) -> *mut c_void;
    fn rtcCommitGeometry(geometry: *mut c_void);
    fn rtcAttachGeometry(scene: *mut c_void, geometry: *mut c_void) -> c_uint;
    fn rtcReleaseGeometry(geometry: *mut c_void);
    fn rtcCommitScene(scene: *mut c_void);
    fn rtcIntersect1(scene: *mut c_void, ray: *mut RayHit, arguments: *mut Arguments);
    fn rtcOccluded1(scene: *mut c_void, ray: *mut RayHit, arguments: *mut Arguments);
    fn rtcIntersect16(valid: *const c_int, scene: *mut c_void, rays: *mut RayHit16, arguments: *mut Arguments);
    fn rtcOccluded16(valid: *const c_int, scene: *mut c_void, rays: *mut RayHit16, arguments: *mut Arguments);
}

/// A device, with so many threads for building.
pub struct Device(*mut c_void);

/// Triangles in Embree's tree.
pub struct Scene(*mut c_void);

// SAFETY: queries of a committed scene may come from any thread (manual, "Multi-Threading").
unsafe impl Send for Scene {}
// SAFETY: as above.
unsafe impl Sync for Scene {}

impl Device {
    pub fn new(threads: usize) -> Self {
        let settings = CString::new(format!("threads={threads}")).expect("no zero byte");
        // SAFETY: the string outlives the call.
        let device = unsafe { rtcNewDevice(settings.as_ptr()) };
        assert!(!device.is_null(), "Embree gives no device");
        Self(device)
    }

    /// Major, minor and patch number as one.
    pub fn version(&self) -> isize {
        // SAFETY: property 0 is the version.
        unsafe { rtcGetDeviceProperty(self.0, 0) }
    }

    /// A scene of triangles as it comes, and the seconds that its tree took.
    pub fn scene(&self, triangles: &[[[f32; 3]; 3]]) -> (Scene, f64) {
        let count = triangles.len();
        let indices: Vec<u32> = (0..3 * count as u32).collect();
        // SAFETY: geometry 0 is triangles; its buffers 1 (positions, three floats: 0x9003) and 0 (indices, three words: 0x5003)
        // have as many bytes as are copied into them.
        unsafe {
            let scene = rtcNewScene(self.0);
            let geometry = rtcNewGeometry(self.0, 0);
            let positions: *mut f32 = rtcSetNewGeometryBuffer(geometry, 1, 0, 0x9003, 12, 3 * count).cast();
            let corners: *mut u32 = rtcSetNewGeometryBuffer(geometry, 0, 0, 0x5003, 12, count).cast();
            assert!(!positions.is_null() && !corners.is_null(), "Embree gives no buffers");
            positions.copy_from_nonoverlapping(triangles.as_ptr().cast(), 9 * count);
            corners.copy_from_nonoverlapping(indices.as_ptr(), 3 * count);
            rtcCommitGeometry(geometry);
            rtcAttachGeometry(scene, geometry);
            rtcReleaseGeometry(geometry);
            let started = Instant::now();
            rtcCommitScene(scene);
            let taken = started.elapsed().as_secs_f64();
            assert_eq!(rtcGetDeviceError(self.0), 0, "Embree's error number");
            (Scene(scene), taken)
        }
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: nobody has it any more.
        unsafe { rtcReleaseScene(self.0) }
    }
}

impl Scene {
    /// The nearest hit, or with `any` whether there is one: then `far` is −∞.
    pub fn trace_one(&self, ray: &mut RayHit, any: bool) {
        // SAFETY: the ray is laid out as Embree's; no arguments are the usual ones.
        unsafe {
            if any {
                rtcOccluded1(self.0, ray, null_mut());
            } else {
                rtcIntersect1(self.0, ray, null_mut());
            }
        }
    }

    /// The same for 16 rays, told that they are coherent or not.
    pub fn trace_packet(&self, valid: &Valid, rays: &mut RayHit16, any: bool, coherent: bool) {
        let mut arguments = Arguments {
            flags: if coherent { COHERENT } else { 0 },
            features: -1,
            context: null_mut(),
            filter: null_mut(),
            intersect: null_mut(),
            more: [0; 4],
        };
        // SAFETY: rays, mask and arguments are laid out and aligned as Embree's, and outlive the call.
        unsafe {
            if any {
                rtcOccluded16(valid.0.as_ptr(), self.0, rays, &raw mut arguments);
            } else {
                rtcIntersect16(valid.0.as_ptr(), self.0, rays, &raw mut arguments);
            }
        }
    }
}

//! Queries for single rays through nodes of eight boxes.
//!
//! The kernels differ in instructions and bookkeeping alone. A box of a node is the union of its triangles' own padded boxes, exactly:
//! minimum and maximum round nothing. It is tested by the operations of [`slab`](super::slab), with the planes that come first chosen by
//! the direction's sign; since rounding is monotone, (plane − origin) · reciprocal of an enclosing box never lies inside that of
//! an enclosed one, and of two planes the one that the sign says is the smaller product, as the minimum in `slab` finds. So a
//! node is passed over only where no triangle under it can be hit at a distance that counts, and the answer is that of
//! [`meet`] over all triangles. The wider kernels may find a plane up to a few roundings nearer and farther, which is as safe
//! (`distances` in `vector8.rs`).
//!
//! The portable kernel has nothing unsafe in it, and is all that Miri sees: `cargo +nightly miri test --lib accel::single` checks
//! the tree and the reference, with `MIRIFLAGS="-Zmiri-tree-borrows -Zmiri-ignore-leaks"`, since the thread pool that builds the tree
//! breaks the older rules and outlives the test. What is unsafe in the other kernels is loads, stores, children that are not
//! checked to exist, and the stack of what waits.

#![allow(clippy::needless_range_loop, reason = "a lane is a column of several rows at once")]

use glam::Vec3;

use super::build::Accel;
use super::nodes8::{Block8, LEAF, Node8, Tree8, WIDTH};
use super::stack::{FEW, parts, waiting};
use super::{Bounds, Hit, Kernel, Ray, larger, meet, reciprocal_of, slab, smaller};

/// That something is met, where it does not matter what: an entry less than that of any limit that can be met below.
pub(super) const MET: u64 = 0;

impl Accel {
    /// The nearest hit of one ray below `limit`.
    ///
    /// The first call collapses the tree for single rays, in less than a quarter of the time that the tree took.
    #[inline]
    pub fn closest_one(&self, ray: &Ray, limit: f32) -> Option<Hit> {
        hit(run::<false>(self.kernel, self.single_rays(), ray, limit), limit)
    }

    /// Whether one ray meets anything below `limit`. The first call is as that of [`Self::closest_one`].
    #[inline]
    pub fn occluded_one(&self, ray: &Ray, limit: f32) -> bool {
        hit(run::<true>(self.kernel, self.single_rays(), ray, limit), limit).is_some()
    }
}

/// What an entry says that was below `limit` over 0 at first.
#[inline(always)]
fn hit(entry: u64, limit: f32) -> Option<Hit> {
    let (t, triangle) = parts(entry);
    (entry != waiting(limit, 0)).then_some(Hit { t, triangle })
}

/// Finds the nearest hit, or any, as an entry: distance over triangle, of which the least is the nearest and of equally near ones
/// the lowest triangle; [`MET`] for any; `limit` over 0 where there is none, so that a hit at the limit is not less.
/// The processor must have the kernel.
#[inline(always)]
fn run<const ANY: bool>(kernel: Kernel, tree: &Tree8, ray: &Ray, limit: f32) -> u64 {
    let Ray { origin: o, direction: d } = *ray;
    match kernel {
        #[cfg(target_arch = "x86_64")]
        Kernel::Avx512 => {
            // SAFETY: a tree has a kernel only where the processor has its instructions.
            #[allow(unsafe_code, reason = "calling a function compiled for features that were detected")]
            unsafe {
                super::single_avx512::trace::<ANY>(tree, o.x, o.y, o.z, d.x, d.y, d.z, limit)
            }
        }
        #[cfg(target_arch = "x86_64")]
        Kernel::Avx2 => {
            // SAFETY: as above.
            #[allow(unsafe_code, reason = "calling a function compiled for features that were detected")]
            unsafe {
                super::single_avx2::trace::<ANY>(tree, o.x, o.y, o.z, d.x, d.y, d.z, limit)
            }
        }
        _ => trace::<ANY>(tree, ray, limit),
    }
}

/// A ray and the reciprocal of its direction.
struct Way {
    origin: Vec3,
    direction: Vec3,
    reciprocal: Vec3,
}

/// The reference: plain loops over lanes, nothing unsafe. It is not compiled into its caller, where it would be the reason that a
/// ray's numbers are loaded two at a time: those that were just stored one at a time are long in coming then.
#[inline(never)]
fn trace<const ANY: bool>(tree: &Tree8, ray: &Ray, limit: f32) -> u64 {
    let way = Way { origin: ray.origin, direction: ray.direction, reciprocal: reciprocal_of(ray.direction) };
    // The rows of a node's planes that the ray passes first, by axis; the others have the last bit of the index flipped.
    let near_planes = [0, 1, 2].map(|axis| 2 * axis + usize::from(way.reciprocal[axis].is_sign_negative()));
    let mut best = waiting(limit, 0);
    let mut stack = [0u64; FEW];
    let mut heap = Vec::new();
    let stack: &mut [u64] = if tree.waiting <= FEW {
        &mut stack
    } else {
        heap.resize(tree.waiting, 0);
        &mut heap
    };
    let mut count = 1;
    while count > 0 {
        count -= 1;
        let (near, child) = parts(stack[count]);
        let limit = parts(best).0;
        if near > limit {
            continue;
        }
        if child & LEAF != 0 {
            let nearest = test(&tree.blocks[(child ^ LEAF) as usize], tree.pad, &way, best);
            if ANY && nearest != best {
                return MET;
            }
            best = nearest;
            continue;
        }
        let node = &tree.nodes[child as usize];
        let (near, met) = crossings(node, &way, limit, near_planes);
        let first = count;
        for k in 0..WIDTH {
            if met[k] {
                // Sorted by distance, the nearest on top.
                let entry = waiting(near[k], node.children[k]);
                let mut at = count;
                while at > first && stack[at - 1] < entry {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = entry;
                count += 1;
            }
        }
    }
    best
}

/// Where the ray enters the boxes of a node, 0 at the least, and which of them it meets no farther than its limit.
#[inline(always)]
fn crossings(node: &Node8, way: &Way, limit: f32, near_planes: [usize; 3]) -> ([f32; WIDTH], [bool; WIDTH]) {
    let (mut near, mut met) = ([0.0; WIDTH], [false; WIDTH]);
    let [x, y, z] = near_planes.map(|row| [&node.planes[row], &node.planes[row ^ 1]]);
    for k in 0..WIDTH {
        let at = |planes: &[f32; WIDTH], axis: usize| (planes[k] - way.origin[axis]) * way.reciprocal[axis];
        near[k] = larger(larger(at(x[0], 0), at(y[0], 1)), larger(at(z[0], 2), 0.0));
        let far = smaller(smaller(at(x[1], 0), at(y[1], 1)), smaller(at(z[1], 2), limit));
        met[k] = near[k] <= far;
    }
    (near, met)
}

/// The least of an entry and those of the triangles of a block that are hit no farther.
#[inline(always)]
fn test(block: &Block8, pad: f32, way: &Way, best: u64) -> u64 {
    let limit = parts(best).0;
    let nearest = |best: u64, k: usize| {
        let corners =
            [0, 1, 2].map(|c: usize| Vec3::from_array([0, 1, 2].map(|axis: usize| block.corners[c][axis][k])));
        let Bounds { min, max } = super::Triangle { corners }.bounds(pad);
        let (near, far) = slab(min, max, way.origin, way.reciprocal);
        let t = meet(&corners, near, far, way.origin, way.direction);
        if t > 0.0 && t <= limit { best.min(waiting(t, block.ids[k])) } else { best }
    };
    (0..WIDTH).fold(best, nearest)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{Triangle, box_padding, brute_force};
    use super::*;

    /// Coordinates of a coarse lattice: shared edges, ties, triangles without area, rays along axes and through corners.
    fn lattice() -> impl Strategy<Value = Vec3> {
        [-3i8..=3, -3i8..=3, -3i8..=3].prop_map(|c| Vec3::from_array(c.map(|c| f32::from(c) * 0.5)))
    }

    fn anywhere() -> impl Strategy<Value = Vec3> {
        [-2.0f32..2.0, -2.0f32..2.0, -2.0f32..2.0].prop_map(Vec3::from_array)
    }

    fn vector() -> impl Strategy<Value = Vec3> {
        prop_oneof![lattice(), anywhere()]
    }

    fn cases() -> u32 {
        if cfg!(miri) { 8 } else { 600 }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: cases(), failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

        #[test]
        fn every_kernel_meets_what_brute_force_meets(
            corners in prop::collection::vec([vector(), vector(), vector()], 0..60),
            rays in prop::collection::vec((vector(), vector(), prop_oneof![Just(f32::INFINITY), Just(1.0), 0.0f32..3.0, Just(0.0), Just(-0.0), Just(-1.0)]), 16),
            power in prop_oneof![Just(0i32), Just(-20), Just(20)],
            deep in any::<bool>(),
        ) {
            let scale = libm::ldexpf(1.0, power);
            let triangles: Vec<Triangle> =
                corners.iter().map(|c| Triangle { corners: c.map(|v| v * scale) }).collect();
            let reach = 8.0 * scale;
            let accel = Accel::new(&triangles, reach);
            let mut tree = Tree8::new(&accel, box_padding(reach));
            if deep {
                // As if more waited than the processor's stack has room for.
                tree.waiting = 10 * FEW;
            }
            for (origin, direction, limit) in rays {
                let ray = Ray { origin: origin * scale, direction: direction * scale };
                let truth = brute_force(&triangles, reach, &ray, limit);
                for kernel in Kernel::available() {
                    let closest = hit(run::<false>(kernel, &tree, &ray, limit), limit);
                    let any = hit(run::<true>(kernel, &tree, &ray, limit), limit);
                    prop_assert_eq!(closest, truth, "{}: {:?}", kernel, ray);
                    prop_assert_eq!(any.is_some(), truth.is_some(), "{}: {:?}", kernel, ray);
                }
            }
        }
    }

    #[test]
    fn the_first_ray_makes_the_tree_and_the_bytes_tell() {
        let triangles: Vec<Triangle> =
            (0..100).map(|i| Triangle { corners: [Vec3::X, Vec3::Y, Vec3::Z].map(|v| v + i as f32) }).collect();
        let accel = Accel::new(&triangles, 200.0);
        let before = accel.bytes();
        let ray = Ray { origin: Vec3::splat(-1.0), direction: Vec3::ONE };
        assert_eq!(accel.closest_one(&ray, f32::INFINITY).map(|hit| hit.triangle), Some(0));
        assert!(accel.occluded_one(&ray, f32::INFINITY) && !accel.occluded_one(&ray, 1.0));
        assert!(accel.bytes() >= before + 100 * 40);
    }
}

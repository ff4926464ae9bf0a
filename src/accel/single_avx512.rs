//! Single rays in 256-bit registers with the mask registers and the thirty-two registers of AVX-512VL.

use std::arch::x86_64::*;
use std::mem::MaybeUninit;

use glam::Vec3;

use super::descent::{descend, kernel};
use super::nodes8::{LEAF, Tree8, WIDTH};
use super::single::MET;
use super::stack::{FEW, Stack, parts, waiting};
use super::vector8::{Ray8, array};

kernel!("avx512f,avx512vl,avx512bw,avx512dq,avx2,fma,bmi1,bmi2,lzcnt,popcnt", true, |near, far| u32::from(
    _mm256_cmp_ps_mask::<_CMP_LE_OQ>(near, far)
));

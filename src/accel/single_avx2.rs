//! Single rays in 256-bit registers.

use std::arch::x86_64::*;
use std::mem::MaybeUninit;

use glam::Vec3;

use super::descent::{descend, kernel};
use super::nodes8::{LEAF, Tree8, WIDTH};
use super::single::MET;
use super::stack::{FEW, Stack, parts, waiting};
use super::vector8::{Ray8, array};

kernel!(
    "avx2,fma,bmi1,bmi2,lzcnt,popcnt",
    false,
    |near, far| _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far)) as u32
);

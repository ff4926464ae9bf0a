//! The largest gap of boxes in the plane by one sweep.

use super::star::Side;
use super::tournament::Tournament;

/// The largest gap of one side, and the corner that reaches it.
#[derive(Debug, Clone, Copy)]
pub struct Peak {
    /// `scale`·x·y − count, or count − `scale`·x·y.
    pub gap: f64,
    pub x: f64,
    pub y: f64,
}

/// The largest gap between `scale`·x·y and the number of points in the box at the origin with corner (x, y), in one
/// direction: expected over counted for open boxes, counted over expected for closed ones.
///
/// `by_x` are the points by rising x, each with the position of its y in `ys`; `ys` rises strictly and ends with 1. While
/// x runs over the abscissae, the gap at y_j is the height of a line at the time s = `scale`·x: s·y_j − (points swept
/// below y_j), or (points swept) − s·y_j − (points swept above y_j). A point that is swept sinks all lines on one side of
/// it, and the highest is known at any time ([`Tournament`]). Points of equal x enter together: the open box is looked
/// at before they do, the closed one after. About O(n log² n), 50 bytes a point.
pub fn sweep(side: Side, scale: f64, by_x: &[(f64, usize)], ys: &[f64]) -> Peak {
    let mut lines = match side {
        Side::Open => Tournament::new(ys.iter().copied()),
        Side::Closed => Tournament::new(ys.iter().rev().map(|y| -y)),
    };
    let mut peak = Peak { gap: f64::NEG_INFINITY, x: 0.0, y: 0.0 };
    let mut look = |lines: &Tournament, s: f64, x: f64, swept: usize| {
        let (z, w) = lines.highest();
        let gap = match side {
            Side::Open => s * z - f64::from(w),
            Side::Closed => (swept as f64 - f64::from(w)) + s * z,
        };
        if gap > peak.gap {
            peak = Peak { gap, x, y: z.abs() };
        }
    };
    let mut swept = 0;
    while swept < by_x.len() {
        let x = by_x[swept].0;
        let s = scale * x;
        lines.advance(s);
        if side == Side::Open {
            look(&lines, s, x, swept);
        }
        while let Some(&(_, position)) = by_x.get(swept).filter(|p| p.0 == x) {
            lines.sink(if side == Side::Open { position + 1 } else { ys.len() - position }, s);
            swept += 1;
        }
        if side == Side::Closed {
            look(&lines, s, x, swept);
        }
    }
    if side == Side::Open {
        // The open box of full width; where a point lies at x = 1 it was looked at before, with fewer points in it.
        lines.advance(scale);
        if by_x.last().is_none_or(|p| p.0 < 1.0) {
            look(&lines, scale, 1.0, swept);
        }
    }
    peak
}

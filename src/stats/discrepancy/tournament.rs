//! Which of many lines is highest, while time runs and lines sink: a kinetic tournament.
//!
//! Line j has the height s·z_j − w_j at time s. Time never runs backwards, and the lines from some position on may sink
//! by one. Every inner node knows the winner below it and until when that holds, so only matches whose result changes are
//! played again. This is what a sweep over boxes asks: s grows with the corner's abscissa, and a point that enters
//! lowers all lines whose boxes contain it.

/// One match, or at the bottom one line.
#[derive(Debug, Clone, Copy)]
struct Node {
    /// The winner's slope.
    z: f64,
    /// The time at which some match at or below this node turns out otherwise.
    until: f64,
    /// How far the winner has sunk, apart from what `sunk` of the nodes above adds.
    w: i32,
    /// How far everything below has sunk together.
    sunk: i32,
}

/// A match before it is played.
const UNPLAYED: Node = Node { z: 0.0, until: f64::INFINITY, w: 0, sunk: 0 };

/// The lines and their matches. O(log m) a sinking, amortised about O(log² m) a change of winner; 48 bytes a line.
#[derive(Debug)]
pub struct Tournament {
    nodes: Vec<Node>,
    /// Where each level begins in `nodes`: lines first, the final last. An odd one out passes without a match.
    levels: Vec<(usize, usize)>,
}

impl Tournament {
    /// Lines with slopes that rise strictly, at time 0, where all have height 0.
    ///
    /// # Panics
    /// Without lines, or with more than an i32 can count.
    pub fn new(slopes: impl Iterator<Item = f64>) -> Self {
        let nodes: Vec<Node> = slopes.map(|z| Node { z, until: f64::INFINITY, w: 0, sunk: 0 }).collect();
        assert!(!nodes.is_empty() && i32::try_from(nodes.len()).is_ok(), "between 1 and 2^31 lines");
        let mut tournament = Self { levels: vec![(0, nodes.len())], nodes };
        while let Some(&(start, count)) = tournament.levels.last().filter(|(_, count)| *count > 1) {
            let (level, matches) = (tournament.levels.len(), count.div_ceil(2));
            tournament.levels.push((start + count, matches));
            tournament.nodes.resize(start + count + matches, UNPLAYED);
            (0..matches).for_each(|index| tournament.play(level, index, 0.0));
        }
        tournament
    }

    /// Lets time run to `s`, not before the time so far.
    pub fn advance(&mut self, s: f64) {
        let top = self.levels.len() - 1;
        if self.nodes[self.levels[top].0].until <= s {
            self.replay(top, 0, s);
        }
    }

    /// Plays again what has turned out otherwise at or below a node by time `s`.
    fn replay(&mut self, level: usize, index: usize, s: f64) {
        let (below, count) = self.levels[level - 1];
        for child in 2 * index..(2 * index + 2).min(count) {
            if self.nodes[below + child].until <= s {
                self.replay(level - 1, child, s);
            }
        }
        self.play(level, index, s);
    }

    /// Lines from `position` on sink by one at time `s`, to which the tournament has advanced.
    pub fn sink(&mut self, position: usize, s: f64) {
        let mut index = position;
        if index >= self.levels[0].1 {
            return;
        }
        self.nodes[index].w += 1;
        for level in 0..self.levels.len() - 1 {
            let (start, count) = self.levels[level];
            if index.is_multiple_of(2) && index + 1 < count {
                let right = &mut self.nodes[start + index + 1];
                right.w += 1;
                right.sunk += 1;
            }
            index /= 2;
            self.play(level + 1, index, s);
        }
    }

    /// The match of a node's two children at time `s`.
    ///
    /// The steeper line overtakes where (z_r − z_l) s = w_r − w_l. Each side rounds once, so a wrong winner costs at most
    /// 2 ε s (z_r − z_l) of height, at each of log₂ m levels.
    fn play(&mut self, level: usize, index: usize, s: f64) {
        let (below, count) = self.levels[level - 1];
        let at = self.levels[level].0 + index;
        let left = self.nodes[below + 2 * index];
        let sunk = self.nodes[at].sunk;
        if 2 * index + 1 == count {
            self.nodes[at] = Node { w: left.w + sunk, sunk, ..left };
            return;
        }
        let right = self.nodes[below + 2 * index + 1];
        let overtakes = f64::from(right.w - left.w) / (right.z - left.z);
        let until = if left.until < right.until { left.until } else { right.until };
        self.nodes[at] = if overtakes <= s {
            Node { z: right.z, until, w: right.w + sunk, sunk }
        } else {
            Node { z: left.z, until: if overtakes < until { overtakes } else { until }, w: left.w + sunk, sunk }
        };
    }

    /// Slope of the highest line and how far it has sunk.
    pub fn highest(&self) -> (f64, i32) {
        let last = self.nodes[self.nodes.len() - 1];
        (last.z, last.w)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::runner;
    use super::*;
    use proptest::prelude::*;

    /// Heights of all lines after every step, computed plainly.
    #[test]
    fn the_highest_line_is_that_of_a_plain_search() {
        let step = (any::<prop::sample::Index>(), 0.0..3.0_f64, 0..3_usize);
        let case = (1..40_usize, prop::collection::vec(step, 1..80), prop::bool::ANY);
        runner(300)
            .run(&case, |(count, steps, clustered)| {
                let slope = |j: usize| {
                    // Slopes a rounding apart, or evenly spread.
                    if clustered {
                        0.5 + (j / 3) as f64 / 64.0 + (j % 3) as f64 * f64::EPSILON
                    } else {
                        j as f64 / 40.0
                    }
                };
                let mut tournament = Tournament::new((0..count).map(slope));
                let mut sunk = vec![0_i32; count];
                let mut time = 0.0;
                for (from, wait, times) in steps {
                    time += wait;
                    tournament.advance(time);
                    for _ in 0..times {
                        let from = from.index(count + 1);
                        tournament.sink(from, time);
                        sunk[from..].iter_mut().for_each(|w| *w += 1);
                    }
                    let (z, w) = tournament.highest();
                    let plain = (0..count).map(|j| time * slope(j) - f64::from(sunk[j])).fold(f64::MIN, f64::max);
                    let bound = 16.0 * f64::EPSILON * (time + 200.0);
                    prop_assert!((time * z - f64::from(w) - plain).abs() <= bound, "at {time}");
                    prop_assert!((0..count).any(|j| slope(j) == z && sunk[j] == w), "no such line");
                }
                Ok(())
            })
            .expect("equal");
    }
}

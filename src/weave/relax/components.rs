//! Which yarns hold each other: the layers that a weave falls into.
//!
//! Yarn A lies on yarn B if it is above it where they cross. Yarns that reach each other both ways
//! along such steps are held together; what is left are layers, each of which can be lifted off all
//! those below. (A. Clapham 1980, "When a fabric hangs together"; T. Enns 1984, "An efficient
//! algorithm determining when a fabric hangs together", find the layers as here, by counting.)
//!
//! Between layers no force is left at the least energy: the forces of a layer on all those below
//! point down, and their sum must be nil. So each layer is relaxed alone, and those of a single yarn
//! not at all.

use crate::weave::pattern::WeavePattern;

/// Yarns held together: ends and picks of the pattern, each in ascending order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Layer {
    pub ends: Vec<usize>,
    pub picks: Vec<usize>,
}

impl Layer {
    /// How many crossings its yarns have with each other.
    pub fn crossings(&self) -> f64 {
        self.ends.len() as f64 * self.picks.len() as f64
    }

    /// Whether it is more than a single yarn.
    pub fn interlaces(&self) -> bool {
        !self.ends.is_empty() && !self.picks.is_empty()
    }
}

/// The layers of a weave from the lowest to the highest. The cost grows with the crossings.
///
/// The k lowest ends and l lowest picks have k l crossings with each other, and in each one of the
/// two lies on the other; so together they lie on k l yarns at least, and on just as many only if
/// none of them lies on any other.
pub(super) fn layers(pattern: &WeavePattern) -> Vec<Layer> {
    let (ends_below, picks_below) = yarns_below(pattern);
    let [ends, picks] = [&ends_below, &picks_below].map(|below| {
        let mut order: Vec<usize> = (0..below.len()).collect();
        order.sort_by_key(|&yarn| below[yarn]);
        order
    });
    let mut layers = Vec::new();
    let (mut from, mut to) = ([0, 0], [0, 0]);
    // How many more yarns the first `to` of both lie on than on each other.
    let mut excess = 0_i64;
    loop {
        // Picks that lie on no more than the ends so far belong to them.
        while to[1] < picks.len() && picks_below[picks[to[1]]] <= to[0] {
            if excess == 0 && to != from {
                layers.push(layer(&ends, &picks, from, to));
                from = to;
            }
            excess -= (to[0] - picks_below[picks[to[1]]]) as i64;
            to[1] += 1;
        }
        if excess == 0 && to != from {
            layers.push(layer(&ends, &picks, from, to));
            from = to;
        }
        if to[0] == ends.len() {
            break;
        }
        excess += ends_below[ends[to[0]]] as i64 - to[1] as i64;
        to[0] += 1;
    }
    layers
}

fn layer(ends: &[usize], picks: &[usize], from: [usize; 2], to: [usize; 2]) -> Layer {
    let [ends, picks] = [(ends, 0), (picks, 1)].map(|(order, axis)| {
        let mut yarns = order[from[axis]..to[axis]].to_vec();
        yarns.sort_unstable();
        yarns
    });
    Layer { ends, picks }
}

/// On how many yarns each end and each pick lies.
fn yarns_below(pattern: &WeavePattern) -> (Vec<usize>, Vec<usize>) {
    let mut ends = vec![0; pattern.ends];
    let mut picks = vec![0; pattern.picks];
    for (row, pick) in pattern.warp_up.chunks_exact(pattern.ends).zip(&mut picks) {
        for (&warp_up, end) in row.iter().zip(&mut ends) {
            *end += usize::from(warp_up);
            *pick += usize::from(!warp_up);
        }
    }
    (ends, picks)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pattern(picks: usize, ends: usize, warp_up: impl Fn(usize, usize) -> bool) -> WeavePattern {
        let warp_up = (0..picks * ends).map(|index| warp_up(index / ends, index % ends)).collect();
        WeavePattern::new(picks, ends, warp_up).unwrap()
    }

    /// Whether each yarn (ends first) lies on each, however many are in between.
    fn reaches(pattern: &WeavePattern) -> Vec<Vec<bool>> {
        let count = pattern.ends + pattern.picks;
        let mut reaches = vec![vec![false; count]; count];
        for pick in 0..pattern.picks {
            for end in 0..pattern.ends {
                let (a, b) = (end, pattern.ends + pick);
                let (above, below) = if pattern.is_warp_up(pick, end) { (a, b) } else { (b, a) };
                reaches[above][below] = true;
            }
        }
        for via in 0..count {
            for from in 0..count {
                if reaches[from][via] {
                    let beyond = reaches[via].clone();
                    reaches[from].iter_mut().zip(beyond).for_each(|(to, reached)| *to |= reached);
                }
            }
        }
        reaches
    }

    #[test]
    fn layers_are_what_reaches_each_other_and_lie_in_order() {
        for seed in 0..400_usize {
            let (picks, ends) = (1 + seed % 7, 1 + seed / 7 % 8);
            // From hardly to well interlaced.
            let limit = 1 + seed % 11;
            let weave = pattern(picks, ends, |pick, end| {
                let mixed = (seed * 7919 + pick * 104_729 + end * 1_299_709) % 65_537;
                mixed * mixed % 10_007 % 11 < limit
            });
            let reaches = reaches(&weave);
            let yarns: Vec<Vec<usize>> = layers(&weave)
                .into_iter()
                .map(|layer| {
                    let picks = layer.picks.iter().map(|pick| ends + pick);
                    layer.ends.iter().copied().chain(picks).collect()
                })
                .collect();
            assert_eq!(yarns.iter().map(Vec::len).sum::<usize>(), ends + picks);
            for (place, layer) in yarns.iter().enumerate() {
                for &yarn in layer {
                    for (other_place, other) in yarns.iter().enumerate() {
                        for &other in other.iter().filter(|&&other| other != yarn) {
                            let together = reaches[yarn][other] && reaches[other][yarn];
                            assert_eq!(together, place == other_place, "{seed}");
                            assert!(!reaches[yarn][other] || place >= other_place, "{seed}");
                        }
                    }
                }
            }
        }
    }
}

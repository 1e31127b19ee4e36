//! How one admitted signal is made of another: changes at every scale of time, and losses lengthened to what is allowed.

use super::{Piece, Signal, Signals};
use crate::random::Stream;

/// Stays that one change lengthens losses around at most; bounds its work.
const MOST_TIGHTENED: usize = 16;
/// Shortest change of a duration \[ns\].
const SHORTEST: f64 = 1e6;

impl Signals {
    /// A signal that differs from `signal`, and is admitted: an instant of change is moved, the signal slides, stretches
    /// are merged, split, swapped, reversed or made periodic. Often losses are then lengthened as far as is allowed.
    pub fn changed(&self, signal: &Signal, stream: &mut Stream) -> Signal {
        let mut pieces = signal.0.clone();
        let at = self.piece_that_matters(&pieces, stream);
        let by = self.some_duration(stream);
        match stream.below(8) {
            0 => move_change(&mut pieces, at, if stream.chance(0.5) { by } else { -by }),
            1 if stream.chance(0.5) => pieces[0].lasts += by,
            1 => cut_front(&mut pieces, by),
            2 => {
                let lasts = pieces.remove(at).lasts;
                match pieces.get_mut(at.saturating_sub(1)) {
                    Some(neighbour) => neighbour.lasts += lasts,
                    None => pieces.push(Piece { graph: stream.below(self.graphs.len()), lasts }),
                }
            }
            3 => {
                let whole = pieces[at];
                let before = (whole.lasts as f64 * stream.unit()) as i64;
                let inserted = Piece { graph: self.some_graph(!self.agrees(whole.graph), stream), lasts: by };
                let after = (whole.lasts - before - by).max(0);
                let parts = [Piece { lasts: before, ..whole }, inserted, Piece { lasts: after, ..whole }];
                pieces.splice(at..=at, parts);
            }
            4 => pieces[at].graph = stream.below(self.graphs.len()),
            5 => {
                let to = (at + 2 + stream.below(6)).min(pieces.len());
                pieces[at..to].reverse();
            }
            6 => {
                let other = self.piece_that_matters(&pieces, stream);
                let by = by.min(pieces[other].lasts);
                pieces[other].lasts -= by;
                pieces[at].lasts += by;
            }
            _ => {
                let (down, up) = (by, self.recovery(by));
                let to = (at + 1 + stream.below(8)).min(pieces.len());
                let mut left: i64 = pieces[at..to].iter().map(|piece| piece.lasts).sum();
                let (nothing, weak) = (self.nothing(), self.some_graph(true, stream));
                let mut turns = Vec::new();
                while left > 0 && up + down > 0 {
                    turns.extend([Piece { graph: nothing, lasts: down }, Piece { graph: weak, lasts: up }]);
                    left -= down + up;
                }
                pieces.splice(at..to, turns);
            }
        }
        let weak = self.some_graph(true, stream);
        let (cut, backwards) = (stream.chance(0.5), stream.chance(0.5));
        let settled =
            if backwards { self.settled_backwards(pieces, weak, cut) } else { self.settled(pieces, weak, cut) };
        if stream.chance(0.7) { self.tightened(settled, stream) } else { settled }
    }

    /// Lengthens losses at the cost of some stays between them, as far as (4.11) and the dwell time allow.
    ///
    /// A window that ends where a stay of U begins exceeds α by at most F, one that begins where it ends by at most B, and
    /// of the windows over both the largest is F − αU + B. A loss that begins δ earlier adds δ to it, and (1 − α) δ to B.
    pub fn tightened(&self, signal: Signal, stream: &mut Stream) -> Signal {
        let Signal(mut pieces) = signal;
        let (alpha, dwell) = (self.allowance.alpha, self.allowance.dwell.nanos());
        for _ in 0..MOST_TIGHTENED.min(pieces.len()) {
            let stay = self.piece_that_matters(&pieces, stream);
            if !self.agrees(pieces[stay].graph) {
                continue;
            }
            let before = stay.checked_sub(1).filter(|&other| !self.agrees(pieces[other].graph));
            let after = Some(stay + 1).filter(|&other| pieces.get(other).is_some_and(|p| !self.agrees(p.graph)));
            let Some(loss) = (if stream.chance(0.5) { before.or(after) } else { after.or(before) }) else { continue };
            let forward = self.excess_over(pieces[..stay].iter());
            let backward = self.excess_over(pieces[stay + 1..].iter().rev());
            let lasts = pieces[stay].lasts;
            let of_loss = if loss > stay { backward } else { forward };
            let most = self.most_excess();
            let over_both = most - forward - backward + alpha * lasts as f64;
            let allowed = over_both.min((most - of_loss) / (1.0 - alpha)).floor() as i64;
            let at_the_rim = stay == 0 || stay + 1 == pieces.len();
            let alike = before.zip(after).is_some_and(|(b, a)| pieces[b].graph == pieces[a].graph);
            let by = match allowed >= lasts && (at_the_rim || alike) {
                true => lasts,
                false => allowed.min(lasts - dwell),
            };
            if by > 0 {
                pieces[stay].lasts -= by;
                pieces[loss].lasts += by;
                pieces = super::joined(pieces);
            }
        }
        Signal(pieces)
    }

    /// Which stretch to change: anywhere, or rather near the end or the start, which matter most for what is left at the
    /// end and for the mean.
    fn piece_that_matters(&self, pieces: &[Piece], stream: &mut Stream) -> usize {
        let (where_, unit) = (stream.below(3), stream.unit());
        let share = match where_ {
            0 => unit,
            1 => 1.0 - unit * unit,
            _ => unit * unit,
        };
        let mut left = (share * self.end.nanos() as f64) as i64;
        pieces
            .iter()
            .position(|piece| {
                left -= piece.lasts;
                left < 0
            })
            .unwrap_or(pieces.len() - 1)
    }

    /// From a part of the dwell time to T_0, every scale as often.
    fn some_duration(&self, stream: &mut Stream) -> i64 {
        let (dwell, t_0) = (self.allowance.dwell.nanos() as f64, self.allowance.t_0.nanos() as f64);
        let shortest = (dwell / 4.0).max(SHORTEST);
        stream.uniform(shortest.ln(), t_0.max(2.0 * dwell).max(2.0 * shortest).ln()).exp() as i64
    }

    fn some_graph(&self, connected: bool, stream: &mut Stream) -> usize {
        // Mostly no link at all: of those that are not connected, rarely does another hurt more.
        match connected {
            true => stream.below(self.connected),
            false if stream.chance(0.7) => self.nothing(),
            false => self.connected + stream.below(self.chosen - self.connected),
        }
    }
}

/// The change after this piece comes `by` later; of the last one the change before.
fn move_change(pieces: &mut [Piece], at: usize, by: i64) {
    let at = at.min(pieces.len().saturating_sub(2));
    if let [one, other, ..] = &mut pieces[at..] {
        let by = by.clamp(-one.lasts, other.lasts);
        one.lasts += by;
        other.lasts -= by;
    }
}

fn cut_front(pieces: &mut [Piece], mut by: i64) {
    for piece in pieces {
        let cut = by.min(piece.lasts);
        piece.lasts -= cut;
        by -= cut;
    }
}

//! What theory needs to know of the planned network.

use common::graph::Graph;
use common::graph::measure::Connectivity;
use common::mission::Mission;
use common::time::{Span, Time};

/// Changes of a switching signal looked at when its graphs are collected.
pub(super) const MOST_CHANGES: usize = 20_000;

/// The planned network of a mission.
pub(super) struct Network {
    /// The graph of all links.
    pub(super) graph: Graph,
    /// What the planned switching signal amounts to.
    pub(super) planned: Connectivity,
    /// The graphs that occur.
    pub(super) graphs: Vec<Graph>,
    /// Share of the time that each directed link is up.
    pub(super) up: Vec<f64>,
    /// Whether there were more changes than are looked at: then graphs that occur later are not known, and shares and the
    /// shortest up time are those of the part that was looked at.
    pub(super) cut_off: bool,
    /// The shortest time that a link is up before it goes down; the whole time, if none goes down.
    pub(super) shortest_up: Span,
    /// Without delay and loss, and all is said that there is, so that it is heard at once.
    pub(super) immediate: bool,
}

impl Network {
    pub(super) fn of(mission: &Mission) -> Network {
        let n = mission.vehicles.len();
        let arcs: Vec<(usize, usize)> = mission.links.iter().map(|link| (link.to, link.from)).collect();
        let mut signal = mission.switching.clone();
        let mut graphs: Vec<Graph> = Vec::new();
        let mut up = vec![0.0; arcs.len()];
        let mut t = Time::ZERO;
        let (mut up_since, mut shortest_up) = (vec![None; arcs.len()], mission.end - Time::ZERO);
        for _ in 0..MOST_CHANGES {
            let present: Vec<usize> = (0..arcs.len()).filter(|&link| signal.is_up(link, t)).collect();
            let next = signal.next_change_after(t).unwrap_or(mission.end).min(mission.end);
            for (link, since) in up_since.iter_mut().enumerate() {
                match (signal.is_up(link, t), *since) {
                    (true, None) => *since = Some(t),
                    (false, Some(up)) => {
                        shortest_up = shortest_up.min(t - up);
                        *since = None;
                    }
                    _ => {}
                }
            }
            for &link in &present {
                up[link] += (next - t).secs() / mission.end.secs();
            }
            let graph = Graph::from_arcs(n, &present.iter().map(|&link| arcs[link]).collect::<Vec<_>>());
            if !graphs.contains(&graph) {
                graphs.push(graph);
            }
            t = next;
            if t >= mission.end {
                break;
            }
        }
        Network {
            graph: mission.graph(),
            planned: Connectivity::planned(mission.switching.clone(), n, &arcs, mission.end),
            graphs,
            up,
            cut_off: t < mission.end,
            shortest_up,
            immediate: mission.talk.is_none()
                && mission.every_message_takes(Span::ZERO)
                && mission.loses_by_switching_only(),
        }
    }

    /// α of the planned signal (Definition 4.3).
    pub(super) fn alpha(&self) -> f64 {
        self.planned.loss_fraction()
    }

    /// T_0 for that α; `None` if the fleet is never connected.
    pub(super) fn t_0(&self) -> Option<Span> {
        (self.alpha() < 1.0).then(|| self.planned.t_0(self.alpha()))
    }

    /// Whether the network never changes and passes everything on at once.
    pub(super) fn is_fixed(&self) -> bool {
        self.graphs.len() == 1 && self.immediate
    }

    /// Whether every vehicle has a neighbour at all times.
    pub(super) fn leaves_nobody_alone(&self) -> bool {
        self.graphs.iter().all(|graph| (0..graph.len()).all(|i| graph.degree(i) > 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BRIEF_LOSSES: &str = include_str!("../../../missions/brief-losses.toml");

    fn network(text: &str) -> Network {
        Network::of(&Mission::parse("m.toml", text).unwrap_or_else(|faults| panic!("{faults}")))
    }

    #[test]
    fn whether_all_changes_were_looked_at_is_known() {
        let all = network(BRIEF_LOSSES);
        assert!(!all.cut_off && all.shortest_up == Span::from_secs(2.5));
        // Three days of windows every 10 s change more often than is looked at.
        let long = BRIEF_LOSSES.replace("duration_s = 120.0", "duration_s = 259200.0");
        assert!(network(&long).cut_off);
    }
}

//! The graph of a mission's links with its matrices, and all graphs that its switching signal can take.

use common::graph::incidence::{Differences, SpanningTree, incidence, orientation};
use common::graph::{Graph, rows, spectrum};
use common::mission::Mission;
use common::mission::file::LawChoice;

use crate::results::{GraphFacts, SpanningFacts, SplitFacts, TakenFacts};

/// So many graphs of a signal are looked at.
const MOST_GRAPHS: usize = 1024;

/// What graph theory says of this mission's network.
pub fn graph_facts(mission: &Mission) -> GraphFacts {
    let graph = mission.graph();
    let two_way = graph.is_undirected();
    let id = |vehicle: usize| mission.vehicles[vehicle].id.clone();
    let eigenvalues = spectrum::eigenvalues(&graph.laplacian()).unwrap_or_default();
    GraphFacts {
        vehicles: mission.vehicles.iter().map(|vehicle| vehicle.id.clone()).collect(),
        two_way,
        connected: graph.is_connected(),
        globally_reachable: graph.globally_reachable().into_iter().map(id).collect(),
        degrees: (0..graph.len()).map(|i| graph.degree(i)).collect(),
        adjacency: rows(&graph.adjacency()),
        laplacian: rows(&graph.laplacian()),
        eigenvalues: eigenvalues.iter().map(|mu| [mu.re, mu.im]).collect(),
        lambda_2: spectrum::lambda_2(&graph),
        spanning_tree: two_way.then(|| tree(&graph)).flatten(),
        differences: Differences::of(&graph).map(|split| SplitFacts {
            beta: split.beta.iter().copied().collect(),
            f_1: rows(&split.f_1),
            f_2: rows(&split.f_2),
            l_11: rows(&split.l_11),
        }),
        taken: taken(mission),
    }
}

fn tree(graph: &Graph) -> Option<SpanningFacts> {
    let links = orientation(graph);
    let tree = SpanningTree::new(graph.len(), &links)?;
    Some(SpanningFacts {
        incidence: rows(&incidence(graph.len(), &links)),
        links: links.iter().map(|&(tail, head)| [tail, head]).collect(),
        m_1: rows(&tree.m_1),
        u: rows(&tree.u),
        y_squared: rows(&tree.y_squared),
        tree: tree.tree,
    })
}

fn taken(mission: &Mission) -> TakenFacts {
    let n = mission.vehicles.len();
    let arcs: Vec<(usize, usize)> = mission.links.iter().map(|link| (link.to, link.from)).collect();
    let possible = mission.switching.possible(MOST_GRAPHS);
    let mut graphs: Vec<Graph> = Vec::new();
    for state in &possible.states {
        let up: Vec<_> = arcs.iter().zip(state).filter(|(_, up)| **up).map(|(arc, _)| *arc).collect();
        let graph = Graph::from_arcs(n, &up);
        if !graphs.contains(&graph) {
            graphs.push(graph);
        }
    }
    let gains = match &mission.law_choice {
        LawChoice::Switching(law) => vec![law.gain; n],
        _ => vec![1.0; n],
    };
    let union = graphs.iter().fold(Graph::empty(n), |union, graph| union.union(graph));
    let two_way = graphs.iter().all(Graph::is_undirected);
    let largest = graphs.iter().filter_map(|graph| spectrum::symmetric_eigenvalues(&graph.laplacian()).last().copied());
    TakenFacts {
        graphs: graphs.len(),
        complete: possible.complete,
        connected: graphs.iter().filter(|graph| graph.can_agree()).count(),
        union_connected: union.can_agree(),
        lambda_2m: spectrum::lambda_2m(&graphs, &gains),
        lambda_m: spectrum::lambda_m(&graphs, &gains),
        lambda_m_lower_bound: spectrum::lambda_m_lower_bound(&graphs, &gains),
        largest: if two_way { largest.max_by(f64::total_cmp) } else { None },
    }
}

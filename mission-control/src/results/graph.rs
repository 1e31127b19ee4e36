//! The network as a graph: its matrices, as the report, `check --graph` and programs show them.

use serde::Serialize;

/// A matrix, row by row.
pub(crate) type Matrix = Vec<Vec<f64>>;

/// Fleets of up to so many vehicles have their matrices printed.
pub(crate) const MOST_PRINTED: usize = 8;

/// The graph of all links (sections 3.1, 4.2). Vehicle i receives from vehicle j where `adjacency[i][j]` is 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct GraphFacts {
    /// The vehicles, in the order of rows and columns.
    pub vehicles: Vec<String>,
    /// Whether every link works both ways.
    pub two_way: bool,
    /// Whether any two vehicles are joined, whatever the directions.
    pub connected: bool,
    /// Whom all others hear, directly or through others (Lemma 3.9).
    pub globally_reachable: Vec<String>,
    /// |N_i|.
    pub degrees: Vec<usize>,
    /// A.
    pub adjacency: Matrix,
    /// L = D − A.
    pub laplacian: Matrix,
    /// σ(L), each as [real, imaginary].
    pub eigenvalues: Vec<[f64; 2]>,
    /// λ_2, for two-way links.
    pub lambda_2: Option<f64>,
    /// The decomposition L = M_1 Y² M_1', for two-way links that connect.
    pub spanning_tree: Option<SpanningFacts>,
    /// F_1, F_2, L_11, where vehicles can agree.
    pub differences: Option<SplitFacts>,
    /// All graphs that the switching signal can take.
    pub taken: TakenFacts,
}

/// The incidence matrix and a spanning tree (Lemmas 3.5 to 3.8).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SpanningFacts {
    /// Each link once, as numbers of vehicles from 0: [tail, head].
    pub links: Vec<[usize; 2]>,
    /// M, a column for each link.
    pub incidence: Matrix,
    /// Which links are in the tree.
    pub tree: Vec<usize>,
    /// M_1, the columns of the tree.
    pub m_1: Matrix,
    /// U, with M = M_1 \[I U'\] up to the order of columns.
    pub u: Matrix,
    /// Y² = I + U'U.
    pub y_squared: Matrix,
}

/// What acts on differences (3.6)–(3.8).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SplitFacts {
    /// β, whose word counts for how much: β'L = 0, β'1 = 1.
    pub beta: Vec<f64>,
    /// F_1.
    pub f_1: Matrix,
    /// F_2.
    pub f_2: Matrix,
    /// L_11.
    pub l_11: Matrix,
}

/// All graphs that the switching signal can take by its kind, whatever the seed (Lemma 4.1).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TakenFacts {
    /// How many different ones.
    pub graphs: usize,
    /// Whether that is all; if not, there are more than were looked at.
    pub complete: bool,
    /// How many of them connect the fleet.
    pub connected: usize,
    /// Whether all of them together connect it.
    pub union_connected: bool,
    /// λ_2,m (property 8): the least λ_2 of those that connect.
    pub lambda_2m: Option<f64>,
    /// λ_m (property 8) for the gains of the law, where it has one gain for each vehicle; for equal gains otherwise.
    pub lambda_m: Option<f64>,
    /// (β'1)²/(n β'β) λ_2,m ≤ λ_m (erratum 4.6).
    pub lambda_m_lower_bound: Option<f64>,
    /// The largest eigenvalue of any of them.
    pub largest: Option<f64>,
}

impl TakenFacts {
    /// How many, in words.
    pub fn words(&self) -> String {
        match (self.graphs, self.complete) {
            (1, true) => "1 graph".into(),
            (graphs, true) => format!("{graphs} graphs"),
            (graphs, false) => format!("the first {graphs} graphs (cut off: there are more)"),
        }
    }
}

impl GraphFacts {
    /// What there is to say, as pairs of a name and a line.
    pub fn facts(&self) -> Vec<(&'static str, String)> {
        let number = |value: Option<f64>| value.map_or("–".to_string(), |value| format!("{value:.4}"));
        let degrees: Vec<String> =
            self.vehicles.iter().zip(&self.degrees).map(|(id, degree)| format!("{id} {degree}")).collect();
        let eigenvalues: Vec<String> = self.eigenvalues.iter().map(|[re, im]| complex(*re, *im)).collect();
        let kind = match (self.two_way, self.connected) {
            (true, true) => "two-way links, connected",
            (true, false) => "two-way links, not connected",
            (false, true) => "one-way links, joined if directions are left aside",
            (false, false) => "one-way links, in parts",
        };
        let heard =
            if self.globally_reachable.is_empty() { "nobody".into() } else { self.globally_reachable.join(", ") };
        let taken = &self.taken;
        vec![
            ("links", kind.into()),
            ("degrees |N_i|", degrees.join(", ")),
            ("globally reachable", heard),
            ("σ(L)", eigenvalues.join(", ")),
            ("λ₂", number(self.lambda_2)),
            (
                "graphs that the signal can take",
                format!(
                    "{}, {} connected, their union {}",
                    taken.words(),
                    taken.connected,
                    if taken.union_connected { "connected" } else { "not connected" }
                ),
            ),
            (
                "over all of them",
                format!(
                    "λ₂,ₘ = {}, λₘ = {} ≥ {}, largest eigenvalue {}",
                    number(taken.lambda_2m),
                    number(taken.lambda_m),
                    number(taken.lambda_m_lower_bound),
                    number(taken.largest)
                ),
            ),
        ]
    }

    /// Its matrices with their names; none for a large fleet.
    pub fn matrices(&self) -> Vec<(&'static str, &Matrix)> {
        if self.vehicles.len() > MOST_PRINTED {
            return Vec::new();
        }
        let mut matrices = vec![("adjacency A", &self.adjacency), ("Laplacian L = D − A", &self.laplacian)];
        if let Some(tree) = &self.spanning_tree {
            matrices.extend([
                ("incidence M, a column for each link", &tree.incidence),
                ("M₁ of a spanning tree", &tree.m_1),
                ("Y² of L = M₁Y²M₁' (3.4)", &tree.y_squared),
            ]);
        }
        if let Some(split) = &self.differences {
            matrices.extend([("F₁ (3.6)", &split.f_1), ("F₂ (3.7)", &split.f_2), ("L₁₁ (3.8)", &split.l_11)]);
        }
        matrices.retain(|(_, matrix)| matrix.iter().any(|row| !row.is_empty()));
        matrices
    }

    /// All of it as lines of text.
    pub fn lines(&self) -> Vec<String> {
        let mut lines: Vec<String> = self.facts().into_iter().map(|(name, text)| format!("{name}: {text}")).collect();
        for (name, matrix) in self.matrices() {
            lines.push(format!("{name}:"));
            lines.extend(printed(matrix));
        }
        lines
    }
}

fn complex(re: f64, im: f64) -> String {
    // An eigenvalue that is zero may come out as a rounding error of either sign.
    let re = if re.abs() < 5e-5 { 0.0 } else { re };
    if im == 0.0 { format!("{re:.4}") } else { format!("{re:.4} {im:+.4}j") }
}

/// The rows of a matrix, their columns in line.
pub(crate) fn printed(matrix: &Matrix) -> Vec<String> {
    let whole = matrix.iter().flatten().all(|entry| entry.fract() == 0.0);
    let cell = |entry: &f64| if whole { format!("{entry:>4}") } else { format!("{entry:>9.4}") };
    matrix.iter().map(|row| row.iter().map(cell).collect::<Vec<_>>().join("")).collect()
}

//! temporary
#[derive(Clone, Debug)]
pub struct Graph { rows: Vec<u64> }
impl Graph {
    pub fn from_arcs(n: usize, arcs: &[(usize, usize)]) -> Graph {
        let mut rows = vec![0; n];
        for (i, j) in arcs { rows[*i] |= 1 << j; }
        Graph { rows }
    }
    pub fn can_agree(&self) -> bool {
        let n = self.rows.len();
        (0..n).any(|root| {
            let mut seen = 1u64 << root;
            loop {
                let next = (0..n).filter(|i| self.rows[*i] & seen != 0).fold(seen, |s, i| s | 1 << i);
                if next == seen { break; }
                seen = next;
            }
            seen.count_ones() as usize == n
        })
    }
}

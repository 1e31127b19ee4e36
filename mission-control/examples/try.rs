fn main() {
    let path = std::env::args().nth(1).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let m = match common::mission::Mission::parse(&path, &text) {
        Ok(m) => std::sync::Arc::new(m),
        Err(e) => {
            eprintln!("{e}");
            std::process::exit(2)
        }
    };
    for _ in 0..3 {
        let t = std::time::Instant::now();
        let mut n = 0u64;
        let mut last = std::collections::BTreeMap::new();
        let mut worst: f64 = 0.0;
        let out = mission_control::simulate::simulate(
            &m,
            |r| {
                n += 1;
                if let common::record::Row::Exact(common::record::Record::State(s)) = r {
                    if s.t_ns as f64 > 0.9 * m.end.nanos() as f64 {
                        worst = worst.max(s.e_norm_m);
                    }
                    last.insert(s.vehicle.clone(), s);
                } else if let common::record::Row::Clock(c) = r {
                    println!("{c:?}")
                }
            },
            |_| true,
        );
        println!("{out:?} rows {n} in {:?}", t.elapsed());
        for s in last.values() {
            println!("{s:?}");
        }
        println!("worst e {worst}");
    }
}

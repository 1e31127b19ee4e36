//! temporary
use crate::random::Stream;
use crate::time::{Span, Time};
#[derive(Clone, Debug)]
pub struct UpInterval { pub from: Time, pub to: Time, pub links: Option<Vec<usize>> }
#[derive(Clone, Debug)]
pub struct Switching { ivs: Vec<UpInterval>, repeat: Option<Span> }
impl Switching {
    pub fn always(_n: usize) -> Switching { Switching { ivs: vec![UpInterval { from: Time::ZERO, to: Time::MAX, links: None }], repeat: None } }
    pub fn periodic(_n: usize, period: Span, from: Span, len: Span) -> Switching {
        Switching { ivs: vec![UpInterval { from: Time::ZERO + from, to: Time::ZERO + from + len, links: None }], repeat: Some(period) }
    }
    pub fn intervals(_n: usize, ivs: Vec<UpInterval>, repeat: Option<Span>) -> Switching { Switching { ivs, repeat } }
    pub fn random(n: usize, _a: f64, _t: Span, _d: Span, _s: Stream) -> Switching { Switching::always(n) }
    pub fn one_at_a_time(n: usize, _g: Vec<Vec<usize>>, _d: Span) -> Switching { Switching::always(n) }
    fn phase(&self, t: Time) -> Time { match self.repeat { Some(p) => Time::from_nanos(t.nanos().rem_euclid(p.nanos())), None => t } }
    pub fn is_up(&mut self, link: usize, t: Time) -> bool {
        let t = self.phase(t);
        self.ivs.iter().any(|i| i.from <= t && t < i.to && i.links.as_ref().is_none_or(|l| l.contains(&link)))
    }
    pub fn next_change_after(&mut self, t: Time) -> Option<Time> {
        let ph = self.phase(t);
        let base = t - ph;
        let mut c: Vec<Time> = Vec::new();
        for i in &self.ivs { for e in [i.from, i.to] { c.push(e); if let Some(p) = self.repeat { c.push(e + p); } } }
        c.into_iter().filter(|e| *e > ph && *e < Time::MAX).min().map(|e| Time::ZERO + base + (e - Time::ZERO))
    }
}

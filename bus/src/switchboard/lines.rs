//! The hub's lines, as the threads that send see them.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use super::{HubEvent, LineId};
use crate::counts::Tally;
use crate::inbox::Inbox;

/// All lines, by number.
#[derive(Default)]
pub(super) struct Lines(RwLock<Vec<Arc<HubLine>>>);

pub(super) struct HubLine {
    pub(super) id: String,
    pub(super) tally: Arc<Tally>,
    /// Whether the program has ever heard of it.
    pub(super) known: AtomicBool,
    /// The living session's way out, if there is one.
    inbox: Mutex<Option<Arc<Inbox<HubEvent>>>>,
}

impl HubLine {
    /// A line on which nothing has passed.
    pub(super) fn new(id: &str) -> HubLine {
        HubLine {
            id: id.into(),
            tally: Arc::new(Tally::of(id)),
            known: AtomicBool::new(false),
            inbox: Mutex::default(),
        }
    }

    pub(super) fn inbox(&self) -> Option<Arc<Inbox<HubEvent>>> {
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub(super) fn set_inbox(&self, inbox: Option<Arc<Inbox<HubEvent>>>) {
        *self.inbox.lock().unwrap_or_else(PoisonError::into_inner) = inbox;
    }
}

impl Lines {
    pub(super) fn get(&self, line: LineId) -> Option<Arc<HubLine>> {
        self.0.read().unwrap_or_else(PoisonError::into_inner).get(line.index()).cloned()
    }

    pub(super) fn add(&self, line: HubLine) -> LineId {
        let mut lines = self.0.write().unwrap_or_else(PoisonError::into_inner);
        lines.push(Arc::new(line));
        LineId((lines.len() - 1) as u16)
    }

    /// The ways out of those whose participant is there.
    pub(super) fn open(&self) -> Vec<Arc<Inbox<HubEvent>>> {
        let lines = self.0.read().unwrap_or_else(PoisonError::into_inner).clone();
        lines.iter().filter_map(|line| line.inbox()).filter(|inbox| inbox.is_open()).collect()
    }

    /// Puts another line in the place of one that the program has never heard of.
    pub(super) fn replace(&self, at: LineId, line: HubLine) -> LineId {
        let mut lines = self.0.write().unwrap_or_else(PoisonError::into_inner);
        if let Some(place) = lines.get_mut(at.index()) {
            *place = Arc::new(line);
        }
        at
    }
}

//! The map, worked on in a thread of its own.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use super::inline::answered;
use super::{Answer, Mapping, Request};
use crate::map::Map;
use crate::mapping::Mapper;

/// A map that is worked on in a thread of its own. Dropping this ends the thread, after the work that it is at.
#[derive(Debug)]
pub struct BackgroundMapping {
    requests: Option<Sender<Request>>,
    /// Never locked: the mutex makes what holds this one that threads may share, as the runtimes of nodes ask for.
    answers: Mutex<Receiver<Answer>>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<Mapper>>,
}

#[derive(Debug)]
struct Shared {
    /// What was asked and is not answered yet.
    waiting: AtomicUsize,
    /// Held only to take or put the snapshot, never while anything is worked on.
    map: Mutex<Arc<Map>>,
}

impl BackgroundMapping {
    /// Begins with this map.
    ///
    /// # Errors
    /// When there is no thread to be had.
    pub fn new(mapper: Mapper) -> std::io::Result<Self> {
        let (requests, asked) = channel();
        let (tell, answers) = channel();
        let map = Mutex::new(Arc::new(mapper.map().clone()));
        let shared = Arc::new(Shared { waiting: AtomicUsize::new(0), map });
        let of_thread = Arc::clone(&shared);
        let thread = thread::Builder::new()
            .name("mapping".to_owned())
            .spawn(move || work(mapper, &asked, &tell, &of_thread))?;
        Ok(Self {
            requests: Some(requests),
            answers: Mutex::new(answers),
            shared,
            thread: Some(thread),
        })
    }

    /// Ends the thread after all that was asked is done, and gives the map back. `None` where the thread has panicked.
    #[must_use]
    pub fn finish(mut self) -> Option<Mapper> {
        self.requests = None;
        self.thread.take()?.join().ok()
    }
}

impl Drop for BackgroundMapping {
    fn drop(&mut self) {
        self.requests = None;
        if let Some(thread) = self.thread.take() {
            // A panic there was told by the runtime already.
            thread.join().ok();
        }
    }
}

impl Mapping for BackgroundMapping {
    fn map(&self) -> Arc<Map> {
        Arc::clone(&self.shared.map.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn is_idle(&self) -> bool {
        self.shared.waiting.load(Ordering::Acquire) == 0
    }

    fn ask(&mut self, request: Request) {
        self.shared.waiting.fetch_add(1, Ordering::AcqRel);
        // The thread ends before this only by a panic; then nothing is answered any more.
        if let Some(requests) = &self.requests {
            requests.send(request).ok();
        }
    }

    fn answers(&mut self) -> Vec<Answer> {
        let answers = self.answers.get_mut().unwrap_or_else(PoisonError::into_inner);
        answers.try_iter().collect()
    }
}

fn work(
    mut mapper: Mapper,
    asked: &Receiver<Request>,
    tell: &Sender<Answer>,
    shared: &Shared,
) -> Mapper {
    while let Ok(request) = asked.recv() {
        // Another request waits: what is only better when it is done may be left as it is.
        let is_aborted = || shared.waiting.load(Ordering::Acquire) > 1;
        let done = answered(&mut mapper, request, &is_aborted);
        let map = Arc::new(mapper.map().clone());
        *shared.map.lock().unwrap_or_else(PoisonError::into_inner) = Arc::clone(&map);
        // Told before it is idle again: who finds it idle finds the answer, too.
        if tell.send(Answer { map, done }).is_err() {
            break;
        }
        shared.waiting.fetch_sub(1, Ordering::AcqRel);
    }
    mapper
}

//! The map, worked on in a thread of its own.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use super::inline::answered;
use super::{Done, Mapping, Request};
use crate::map::Map;
use crate::mapping::Mapper;

/// A map that is worked on in a thread of its own. Dropping this ends the thread, after the work that it is at.
#[derive(Debug)]
pub struct BackgroundMapping {
    requests: Option<Sender<Request>>,
    /// Never locked: the mutex makes what holds this one that threads may share, as the runtimes of nodes ask for.
    answers: Mutex<Receiver<(Arc<Map>, Done)>>,
    /// As of the last answer that was taken: a newer one would not fit what the caller knows by then.
    map: Arc<Map>,
    /// What was asked and is not answered yet.
    waiting: Arc<AtomicUsize>,
    thread: Option<JoinHandle<Mapper>>,
}

impl BackgroundMapping {
    /// Begins with this map.
    ///
    /// # Errors
    /// When there is no thread to be had.
    pub fn new(mapper: Mapper) -> std::io::Result<Self> {
        let (requests, asked) = channel();
        let (tell, answers) = channel();
        let map = Arc::new(mapper.map().clone());
        let waiting = Arc::new(AtomicUsize::new(0));
        let of_thread = Arc::clone(&waiting);
        let thread = thread::Builder::new()
            .name("mapping".to_owned())
            .spawn(move || work(mapper, &asked, &tell, &of_thread))?;
        let (requests, answers) = (Some(requests), Mutex::new(answers));
        Ok(Self { requests, answers, map, waiting, thread: Some(thread) })
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
        Arc::clone(&self.map)
    }

    fn is_idle(&self) -> bool {
        self.waiting.load(Ordering::Acquire) == 0
    }

    fn ask(&mut self, request: Request) {
        self.waiting.fetch_add(1, Ordering::AcqRel);
        // The thread ends before this only by a panic; then nothing is answered any more.
        if let Some(requests) = &self.requests {
            requests.send(request).ok();
        }
    }

    fn answers(&mut self) -> Vec<Done> {
        let answers = self.answers.get_mut().unwrap_or_else(PoisonError::into_inner);
        let answers: Vec<(Arc<Map>, Done)> = answers.try_iter().collect();
        let done = answers.into_iter().map(|(map, done)| {
            self.map = map;
            done
        });
        done.collect()
    }
}

fn work(
    mut mapper: Mapper,
    asked: &Receiver<Request>,
    tell: &Sender<(Arc<Map>, Done)>,
    waiting: &AtomicUsize,
) -> Mapper {
    while let Ok(request) = asked.recv() {
        // Another request waits: what is only better when it is done may be left as it is.
        let is_aborted = || waiting.load(Ordering::Acquire) > 1;
        let done = answered(&mut mapper, request, &is_aborted);
        let map = Arc::new(mapper.map().clone());
        // Told before it is idle again: who finds it idle finds the answer, too.
        if tell.send((map, done)).is_err() {
            break;
        }
        waiting.fetch_sub(1, Ordering::AcqRel);
    }
    mapper
}

//! Loops are looked for in a thread of its own, so that no scan waits for it.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use nalgebra::Isometry3;

use crate::loop_closing::{
    KnownLoops, LoopAnswer, LoopCloser, LoopClosingConfig, LoopSearch, Place,
};

/// No more places wait while one is looked for: forty metres of travel, and some 30 MB of a sensor of 64 rays.
const MOST_WAITING: usize = 20;

/// Searches in a thread of its own. Places that arrive meanwhile are kept, and of these only the last one is searched for then.
/// Dropping this ends the thread, which aborts its search.
#[derive(Debug)]
pub struct BackgroundSearch {
    config: LoopClosingConfig,
    requests: Option<Sender<Request>>,
    /// Never locked: the mutex makes the owner of this shareable between threads, as the runtimes of nodes require.
    answers: Mutex<Receiver<Answer>>,
    /// As of the last answer that was taken.
    known: Arc<KnownLoops>,
    shared: Arc<Shared>,
    /// Of the last place that was handed over.
    last: Option<Isometry3<f64>>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    /// Places that are not answered yet.
    waiting: AtomicUsize,
    /// How often everything was reset: answers of another drive are dropped.
    drive: AtomicU64,
}

struct Request {
    drive: u64,
    place: Place,
}

struct Answer {
    drive: u64,
    answer: LoopAnswer,
    known: Arc<KnownLoops>,
}

impl BackgroundSearch {
    /// Begins with what a closer knows.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn new(closer: LoopCloser) -> std::io::Result<Self> {
        Self::with_pause(closer, || {})
    }

    /// The same; each time before something is looked for, `pause` is called in the thread.
    pub(crate) fn with_pause(
        closer: LoopCloser,
        pause: impl FnMut() + Send + 'static,
    ) -> std::io::Result<Self> {
        let (requests, asked) = channel();
        let (sender, answers) = channel();
        let (config, known) = (*closer.config(), Arc::new(closer.known()));
        let last = known.keyframes.last().map(|last| last.odom_from_vehicle);
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let thread = thread::Builder::new()
            .name("loops".to_owned())
            .spawn(move || work(closer, pause, (&asked, &sender), &of_thread))?;
        let (requests, answers) = (Some(requests), Mutex::new(answers));
        Ok(Self { config, requests, answers, known, shared, last, thread: Some(thread) })
    }

    fn drive(&self) -> u64 {
        self.shared.drive.load(Ordering::Acquire)
    }
}

impl Drop for BackgroundSearch {
    fn drop(&mut self) {
        self.shared.drive.fetch_add(1, Ordering::AcqRel);
        self.requests = None;
        if let Some(thread) = self.thread.take() {
            // A panic there was reported by the runtime already.
            thread.join().ok();
        }
    }
}

impl LoopSearch for BackgroundSearch {
    fn wants(&self, odom_from_vehicle: &Isometry3<f64>) -> bool {
        self.config.is_far_enough(self.last.as_ref(), odom_from_vehicle)
    }

    fn take(&mut self, place: Place) -> bool {
        if self.shared.waiting.load(Ordering::Acquire) >= MOST_WAITING {
            return false;
        }
        let odom_from_vehicle = place.odom_from_vehicle;
        let request = Request { drive: self.drive(), place };
        self.shared.waiting.fetch_add(1, Ordering::AcqRel);
        // The thread ends before this only by a panic; then nothing is answered any more.
        let is_taken = self.requests.as_ref().is_some_and(|to| to.send(request).is_ok());
        if is_taken {
            self.last = Some(odom_from_vehicle);
        }
        is_taken
    }

    fn answers(&mut self) -> Vec<LoopAnswer> {
        let drive = self.drive();
        let answers = self.answers.get_mut().unwrap_or_else(PoisonError::into_inner);
        let of_this_drive = answers.try_iter().filter(|answer| answer.drive == drive);
        let answers = of_this_drive.map(|Answer { answer, known, .. }| {
            self.known = known;
            answer
        });
        answers.collect()
    }

    fn known(&self) -> Arc<KnownLoops> {
        Arc::clone(&self.known)
    }

    fn is_idle(&self) -> bool {
        self.shared.waiting.load(Ordering::Acquire) == 0
    }

    fn forget(&mut self) {
        self.shared.drive.fetch_add(1, Ordering::AcqRel);
        self.known = Arc::default();
        self.last = None;
    }
}

fn work(
    mut closer: LoopCloser,
    mut pause: impl FnMut(),
    (asked, sender): (&Receiver<Request>, &Sender<Answer>),
    shared: &Shared,
) {
    let mut drive = 0;
    while let Ok(first) = asked.recv() {
        let (mut latest, mut taken) = (None, 0);
        for request in std::iter::once(first).chain(asked.try_iter()) {
            if request.drive != drive {
                closer.forget();
                (drive, latest) = (request.drive, None);
            }
            let Place { stamp, odom_from_vehicle, points_m } = request.place;
            if closer.keep(stamp, &odom_from_vehicle, &points_m) {
                latest = Some(stamp);
            }
            taken += 1;
        }
        let mut is_heard = true;
        if let Some(stamp) = latest {
            pause();
            let is_aborted = || shared.drive.load(Ordering::Acquire) != drive;
            let answer = LoopAnswer { stamp, outcome: closer.look(&is_aborted) };
            let known = Arc::new(closer.known());
            is_heard = sender.send(Answer { drive, answer, known }).is_ok();
        }
        // Sent before it is idle again: when it is idle the answer is there, too.
        shared.waiting.fetch_sub(taken, Ordering::AcqRel);
        if !is_heard {
            break;
        }
    }
}

//! The map, worked on in a thread of its own.
//!
//! A frame comes every 33 ms and must not wait; a keyframe may. So the thread has a lower priority than the one that it was
//! started from, once it is asked to keep a frame: where there are fewer cores than threads, it uses the time that tracking
//! leaves. In a map that stays as it is a lost camera is searched for with the priority of tracking. And snapshots that are not
//! read any more are given back to the thread, to be taken apart there: that of a map whose loop was closed is made of
//! tens of thousands of pieces.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use crate::map::Map;
use crate::mapping::Mapper;
use crate::slam::{Done, Mapping, Request, answered};

/// By how much the thread is nicer than the one that starts it (`nice(2)`): its share of a busy core is a
/// tenth, and any other thread that wakes up interrupts it. More would stop it altogether on a machine that is busy with other things.
#[cfg(target_os = "linux")]
const NICER_BY: i32 = 10;

/// A map that is worked on in a thread of its own. Dropping this ends the thread, after the work that it is at.
#[derive(Debug)]
pub struct BackgroundMapping {
    requests: Option<Sender<Work>>,
    /// Never locked: the mutex makes the owner of this shareable between threads, as the runtimes of nodes require.
    answers: Mutex<Receiver<(Arc<Map>, Done)>>,
    /// As of the last answer that was taken: a newer one would not fit what the caller knows by then.
    map: Arc<Map>,
    /// Those before, since the last request.
    worn: Vec<Arc<Map>>,
    /// The requests that are not answered yet.
    waiting: Arc<AtomicUsize>,
    thread: Option<JoinHandle<Mapper>>,
}

/// A task of the thread.
#[derive(Debug)]
struct Work {
    request: Request,
    /// Snapshots that are to be dropped.
    worn: Vec<Arc<Map>>,
}

impl BackgroundMapping {
    /// Begins with this map.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn new(mapper: Mapper) -> std::io::Result<Self> {
        let (requests, asked) = channel();
        let (sender, answers) = channel();
        let map = Arc::new(mapper.map().clone());
        let waiting = Arc::new(AtomicUsize::new(0));
        let of_thread = Arc::clone(&waiting);
        let thread = thread::Builder::new()
            .name("mapping".to_owned())
            .spawn(move || work(mapper, &asked, &sender, &of_thread))?;
        let (requests, answers) = (Some(requests), Mutex::new(answers));
        Ok(Self { requests, answers, map, worn: Vec::new(), waiting, thread: Some(thread) })
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
            // A panic there was reported by the runtime already.
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
            let worn = std::mem::take(&mut self.worn);
            requests.send(Work { request, worn }).ok();
        }
    }

    fn answers(&mut self) -> Vec<Done> {
        let answers = self.answers.get_mut().unwrap_or_else(PoisonError::into_inner);
        let answers: Vec<(Arc<Map>, Done)> = answers.try_iter().collect();
        let done = answers.into_iter().map(|(map, done)| {
            self.worn.push(std::mem::replace(&mut self.map, map));
            done
        });
        done.collect()
    }
}

fn work(
    mut mapper: Mapper,
    asked: &Receiver<Work>,
    sender: &Sender<(Arc<Map>, Done)>,
    waiting: &AtomicUsize,
) -> Mapper {
    let mut stands_back = false;
    while let Ok(Work { request, worn }) = asked.recv() {
        drop(worn);
        // A process without privileges cannot revert it.
        if !stands_back && matches!(request, Request::Keep(_)) {
            stand_back();
            stands_back = true;
        }
        // Another request waits: what is only better when it is done may be left as it is.
        let is_aborted = || waiting.load(Ordering::Acquire) > 1;
        let done = answered(&mut mapper, request, &is_aborted);
        let map = Arc::new(mapper.map().clone());
        // Sent before it is idle again: when it is idle the answer is there, too.
        if sender.send((map, done)).is_err() {
            break;
        }
        waiting.fetch_sub(1, Ordering::AcqRel);
    }
    mapper
}

/// Lets others go first. Where it may not, or where priorities are those of processes, all stays as it is.
fn stand_back() {
    #[cfg(target_os = "linux")]
    rustix::process::nice(NICER_BY).ok();
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;
    use crate::frame::Frame;
    use crate::map::testing::{blank, blank_frame};
    use crate::mapping::MappingConfig;
    use crate::slam::{Kept, Predicted};

    fn wait(mapping: &BackgroundMapping) {
        let until = Instant::now() + Duration::from_secs(60);
        while !mapping.is_idle() {
            assert!(Instant::now() < until, "mapping does not end");
            thread::yield_now();
        }
    }

    fn keep(frame: Arc<Frame>) -> Request {
        let new = blank(&frame);
        Request::Keep(Box::new(Kept {
            camera: new.camera,
            camera_from_map: new.camera_from_map,
            frame,
            points: Vec::new(),
            lines: Vec::new(),
            predicted: Predicted::default(),
            by_odometry: None,
        }))
    }

    #[test]
    fn the_map_changes_with_its_answers_and_not_before() {
        let mapper = Mapper::new(MappingConfig::default()).unwrap();
        let mut mapping = BackgroundMapping::new(mapper).unwrap();
        mapping.ask(keep(blank_frame(0, 0)));
        wait(&mapping);
        // The keyframe is in the map, but its answer has not been read here.
        assert!(mapping.map().keyframes().is_empty());
        assert_eq!(mapping.answers().len(), 1);
        assert_eq!(mapping.map().keyframes().len(), 1);
    }

    #[test]
    fn a_snapshot_that_is_worn_is_taken_apart_by_the_thread_of_the_map() {
        let mapper = Mapper::new(MappingConfig::default()).unwrap();
        let mut mapping = BackgroundMapping::new(mapper).unwrap();
        let frame = blank_frame(0, 0);
        let find = || Request::Find { frame: Arc::clone(&frame), camera: blank(&frame).camera };
        let first = Arc::downgrade(&mapping.map());
        mapping.ask(find());
        wait(&mapping);
        assert_eq!(mapping.answers().len(), 1);
        // The reader of the answers did not drop it ...
        assert!(first.upgrade().is_some());
        mapping.ask(find());
        wait(&mapping);
        // ... and it goes with the next request.
        assert!(first.upgrade().is_none());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_thread_that_keeps_frames_lets_others_go_first_and_one_that_only_looks_does_not() {
        use rustix::process::getpriority_process;
        let frame = blank_frame(0, 0);
        let camera = blank(&frame).camera;
        let find = Request::Find { frame: Arc::clone(&frame), camera };
        let own = getpriority_process(None).unwrap();
        let priority_after = |request: Request| {
            let worked = thread::spawn(|| {
                let ((ask, asked), (sender, _answers)) = (channel(), channel());
                ask.send(Work { request, worn: Vec::new() }).unwrap();
                drop(ask);
                let mapper = Mapper::new(MappingConfig::default()).unwrap();
                work(mapper, &asked, &sender, &AtomicUsize::new(1));
                getpriority_process(None).unwrap()
            });
            worked.join().unwrap()
        };
        assert_eq!(priority_after(find), own);
        // 19 is as nice as it gets.
        assert_eq!(priority_after(keep(frame)), (own + NICER_BY).min(19));
        assert_eq!(getpriority_process(None).unwrap(), own);
    }
}

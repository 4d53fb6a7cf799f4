//! The session of a process, and the nodes in it.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use ::zenoh::Wait;
use ::zenoh::config::Config;
use ::zenoh::liveliness::LivelinessToken;
use ::zenoh::pubsub::Subscriber;
use ::zenoh::sample::SampleKind;

use super::ZenohLinks;
use super::keys::{self, End, Kind, NodePlace, Token};
use super::settings::ZenohSettings;
use super::token_changes::TokenChanges;
use crate::process::shutdown::Shutdown;
use crate::settings::names::NodeIdentity;

/// The configuration of a node where the environment names none: the values that rmw_zenoh's own default
/// (`DEFAULT_RMW_ZENOH_SESSION_CONFIG.json5`) has instead of Zenoh's.
const DEFAULT_CONFIG: &str = include_str!("session.json5");

/// What helps where none is connected.
const START_A_ROUTER: &str =
    "start a router (ros2 run rmw_zenoh_cpp rmw_zenohd, or zenohd), or see ZENOH_CONFIG_OVERRIDE";
/// How long it is until the next look for a router.
const BETWEEN_CHECKS: Duration = Duration::from_secs(1);
/// A wait may be without end, and a program ends when it is asked to.
const BETWEEN_LOOKS_FOR_SHUTDOWN: Duration = Duration::from_millis(20);
/// How long the end of a session may take: one whose peer takes nothing more would take 10 s.
const LONGEST_CLOSE: Duration = Duration::from_secs(2);
/// After this many looks the log says again that none is there.
const CHECKS_PER_WARNING: u64 = 10;

/// The session of a process.
pub(crate) struct Session {
    pub(super) zenoh: ::zenoh::Session,
    domain_id: u16,
    id: String,
    next_entity: AtomicU64,
    /// The publishers of this process, which have handed over their messages already.
    own: Mutex<BTreeSet<[u8; 16]>>,
}

impl Session {
    /// Waits for a router as long as the settings say, and no longer than until `shutdown`.
    ///
    /// # Errors
    /// When the configuration is none, or the session cannot be had by it.
    pub(crate) fn open(
        domain_id: u16,
        settings: &ZenohSettings,
        shutdown: &Shutdown,
    ) -> Result<Self, String> {
        let zenoh = ::zenoh::open(config(settings)?)
            .wait()
            .map_err(|error| format!("{}; {START_A_ROUTER}", first_line(&*error)))?;
        look_for_a_router(&zenoh, settings.router_checks, shutdown);
        let id = zenoh.zid().to_string();
        Ok(Self { zenoh, domain_id, id, next_entity: AtomicU64::new(0), own: Mutex::default() })
    }

    fn links(&self) -> ZenohLinks {
        let info = self.zenoh.info();
        ZenohLinks {
            routers: info.routers_zid().wait().count(),
            peers: info.peers_zid().wait().count(),
        }
    }

    pub(super) fn is_own(&self, publisher: &[u8; 16]) -> bool {
        self.lock_own().contains(publisher)
    }

    pub(super) fn enter_own(&self, publisher: [u8; 16]) {
        self.lock_own().insert(publisher);
    }

    pub(super) fn leave_own(&self, publisher: &[u8; 16]) {
        self.lock_own().remove(publisher);
    }

    fn lock_own(&self) -> MutexGuard<'_, BTreeSet<[u8; 16]>> {
        self.own.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn next_id(&self) -> u64 {
        self.next_entity.fetch_add(1, Ordering::Relaxed)
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let closing = self.zenoh.close();
        let (ended, end) = mpsc::channel();
        let close = move || {
            // A session that has failed is closed, and nobody may wait any more.
            let _ = closing.wait();
            let _ = ended.send(());
        };
        if std::thread::Builder::new().name("zenoh_close".to_owned()).spawn(close).is_ok()
            && end.recv_timeout(LONGEST_CLOSE).is_err()
        {
            tracing::debug!("the Zenoh session has not closed within {LONGEST_CLOSE:?}");
        }
    }
}

/// A node on Zenoh.
pub(crate) struct ZenohNode {
    pub(super) session: Arc<Session>,
    place: NodePlace,
    _token: LivelinessToken,
}

impl ZenohNode {
    /// # Errors
    /// When the session is closed.
    pub(crate) fn new(session: &Arc<Session>, identity: &NodeIdentity) -> Result<Self, String> {
        let node_id = session.next_id();
        let place = NodePlace {
            domain_id: session.domain_id,
            session: session.id.clone(),
            node_id,
            namespace: identity.namespace().to_owned(),
            name: identity.name().to_owned(),
        };
        let token = Token { node: place.clone(), entity_id: node_id, kind: Kind::Node, end: None };
        let announced = announce(session, &token)?;
        Ok(Self { session: Arc::clone(session), place, _token: announced })
    }

    /// A new endpoint's token.
    pub(super) fn token(&self, kind: Kind, end: End) -> Token {
        let entity_id = self.session.next_id();
        Token { node: self.place.clone(), entity_id, kind, end: Some(end) }
    }

    pub(super) fn data_key(&self, end: &End) -> String {
        keys::data_key(self.session.domain_id, &end.name, &end.dds_type, &end.hash)
    }

    /// The key of an end whose type may have any definition.
    pub(super) fn any_data_key(&self, end: &End) -> String {
        keys::data_key(self.session.domain_id, &end.name, &end.dds_type, "*")
    }

    /// What the process' session is connected to now.
    pub(crate) fn links(&self) -> ZenohLinks {
        self.session.links()
    }

    /// The identity of the process' session, which all its tokens have.
    pub(crate) fn session_id(&self) -> &str {
        &self.session.id
    }

    /// The tokens of the domain, those that are there at first.
    ///
    /// # Errors
    /// When the session is closed.
    pub(crate) fn follow(&self) -> Result<Tokens, String> {
        let changes = Arc::new(TokenChanges::new());
        let noted = Arc::clone(&changes);
        let subscriber = self
            .session
            .zenoh
            .liveliness()
            .declare_subscriber(keys::all_tokens(self.session.domain_id))
            .history(true)
            .callback(move |sample| {
                noted.note(sample.key_expr().as_str(), sample.kind() == SampleKind::Put);
            })
            .wait()
            .map_err(|error| first_line(&*error))?;
        Ok(Tokens { changes, _subscriber: subscriber })
    }
}

/// The tokens that come and go.
pub(crate) struct Tokens {
    changes: Arc<TokenChanges>,
    _subscriber: Subscriber<()>,
}

impl Tokens {
    /// The next token, and whether it has come.
    pub(crate) async fn next(&mut self) -> (Token, bool) {
        self.changes.next().await
    }
}

pub(super) fn announce(session: &Session, token: &Token) -> Result<LivelinessToken, String> {
    let token = session.zenoh.liveliness().declare_token(token.to_string());
    token.wait().map_err(|error| first_line(&*error))
}

/// Zenoh's errors tell the places in its sources as well.
pub(super) fn first_line(error: &dyn std::fmt::Display) -> String {
    let text = error.to_string();
    let line = text.lines().next().unwrap_or_default();
    line.split(" at /").next().unwrap_or_default().trim_end_matches(['.', '!', ' ']).to_owned()
}

/// Since 1970, by the wall clock.
pub(super) fn now_ns() -> i64 {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since_epoch.as_nanos()).unwrap_or(i64::MAX)
}

fn config(settings: &ZenohSettings) -> Result<Config, String> {
    let mut config = match &settings.config_file {
        Some(file) => Config::from_file(file)
            .map_err(|error| format!("ZENOH_SESSION_CONFIG_URI={file}: {}", first_line(&*error)))?,
        None => Config::from_json5(DEFAULT_CONFIG).map_err(|error| first_line(&*error))?,
    };
    for (key, value) in &settings.overrides {
        config.insert_json5(key, value).map_err(|error| {
            format!("ZENOH_CONFIG_OVERRIDE: {key}={value}: {}", first_line(&*error))
        })?;
    }
    Ok(config)
}

/// Without a router nodes do not find each other: that is said, and the session goes on and connects when there is one.
fn look_for_a_router(zenoh: &::zenoh::Session, checks: u64, shutdown: &Shutdown) {
    for check in 0..checks {
        if zenoh.info().routers_zid().wait().next().is_some() {
            return;
        }
        if check.is_multiple_of(CHECKS_PER_WARNING) {
            tracing::warn!("no Zenoh router is connected: {START_A_ROUTER}");
        }
        if check + 1 == checks {
            return;
        }
        let looked = Instant::now();
        while looked.elapsed() < BETWEEN_CHECKS {
            if shutdown.is_triggered() {
                return;
            }
            std::thread::sleep(BETWEEN_LOOKS_FOR_SHUTDOWN);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> ZenohSettings {
        ZenohSettings { config_file: None, overrides: Vec::new(), router_checks: 0 }
    }

    /// Zenoh's own values are 5 s, after which the connection of a busy machine was closed, and 16 MiB, three clouds.
    #[test]
    fn what_rmw_zenoh_sets_otherwise_than_zenoh_is_set() {
        let config = config(&settings()).unwrap();
        let get = |key: &str| config.get_json(key).unwrap();
        let block = "transport/link/tx/queue/congestion_control/block/wait_before_close";
        assert_eq!(get(block), "60000000");
        let shared = "transport/shared_memory/transport_optimization";
        assert_eq!(get(&format!("{shared}/pool_size")), "50331648");
        assert_eq!(get(&format!("{shared}/message_size_threshold")), "512");
        assert_eq!(get("transport/shared_memory/enabled"), "false");
    }

    #[test]
    fn the_configuration_is_understood_and_what_is_none_is_named() {
        assert!(config(&settings()).is_ok());
        let with = |key: &str, value: &str| ZenohSettings {
            overrides: vec![(key.to_owned(), value.to_owned())],
            ..settings()
        };
        assert!(config(&with("connect/endpoints", "[\"tcp/10.0.0.1:7447\"]")).is_ok());
        let error = config(&with("mode", "\"boss\"")).unwrap_err();
        assert!(error.starts_with("ZENOH_CONFIG_OVERRIDE: mode=\"boss\": "), "{error}");
        let config_file = Some("/nowhere/session.json5".to_owned());
        let error = config(&ZenohSettings { config_file, ..settings() }).unwrap_err();
        assert!(error.starts_with("ZENOH_SESSION_CONFIG_URI=/nowhere/session.json5: "), "{error}");
        assert!(!error.contains('\n'), "{error}");
    }
}

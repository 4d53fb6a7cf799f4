//! Who may look: the token, and the headers by which a browser says whose page asks.
//!
//! A page of another site can make a browser ask a server on the same machine. It cannot choose the headers `Host` and `Origin`: the
//! first is the name that the browser took the server to have (DNS rebinding: a name of another site that leads here), the second the
//! site whose page asks.

use std::fmt;
use std::hint::black_box;
use std::net::IpAddr;

/// Bytes of a token: 128 bits, which nobody guesses.
const TOKEN_BYTES: usize = 16;

/// The names that this machine has for itself.
const LOOPBACK_NAMES: [&str; 3] = ["localhost", "127.0.0.1", "[::1]"];

/// What a browser must know to look.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

impl Token {
    /// A token of random bytes.
    #[must_use]
    pub fn of(random: [u8; TOKEN_BYTES]) -> Self {
        Self(random.iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// Whether `other` is this token; how long that takes tells nothing of it but its length.
    #[must_use]
    pub fn is(&self, other: &str) -> bool {
        let (own, other) = (self.0.as_bytes(), other.as_bytes());
        let different = own.iter().zip(other).fold(0, |bits, (a, b)| black_box(bits | (a ^ b)));
        own.len() == other.len() && different == 0
    }

    /// The token, to be shown to who may look.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.0
    }
}

/// The token is not for logs.
impl fmt::Debug for Token {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Token(..)")
    }
}

/// Who may look.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Access {
    /// Every program of this machine, and no page of another site.
    ThisMachine,
    /// Who knows the token.
    WithToken(Token),
}

/// Why a request is refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Refusal {
    /// The server was asked for by a name that it does not have.
    #[error("this server is asked for by another name than localhost, 127.0.0.1 or [::1]")]
    Host,
    /// A page of another site asks.
    #[error("a page of another site, or none, asks for the data")]
    Origin,
    /// The token is missing or another one.
    #[error(
        "the token is missing or wrong: use the address that the program printed when it started"
    )]
    Token,
}

impl Access {
    /// Who may look at a server on `address`: with a token where others than this machine reach it.
    #[must_use]
    pub fn on(address: IpAddr, random: [u8; TOKEN_BYTES]) -> Self {
        if address.is_loopback() { Self::ThisMachine } else { Self::WithToken(Token::of(random)) }
    }

    /// Whether the page may be sent, by the header `Host` and the token of the request.
    ///
    /// # Errors
    /// When it may not.
    pub fn check_page(&self, host: Option<&str>, token: Option<&str>) -> Result<(), Refusal> {
        match self {
            Self::ThisMachine if host.is_some_and(is_loopback_name) => Ok(()),
            Self::ThisMachine => Err(Refusal::Host),
            Self::WithToken(own) if token.is_some_and(|token| own.is(token)) => Ok(()),
            Self::WithToken(_) => Err(Refusal::Token),
        }
    }

    /// Whether the data may be sent: to the own page alone.
    ///
    /// # Errors
    /// When they may not.
    pub fn check_data(
        &self,
        host: Option<&str>,
        origin: Option<&str>,
        token: Option<&str>,
    ) -> Result<(), Refusal> {
        self.check_page(host, token)?;
        let site = origin.and_then(|origin| {
            origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"))
        });
        match (site, host) {
            (Some(site), Some(host)) if site.eq_ignore_ascii_case(host) => Ok(()),
            _ => Err(Refusal::Origin),
        }
    }
}

/// The sites of viewers that speak Foxglove's protocol. Their programs for the desktop may have others, or none.
const VIEWER_SITES: [&str; 2] = ["https://app.foxglove.dev", "https://studio.foxglove.dev"];

/// Who may connect a viewer of another maker, whose page is not ours.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ViewerAccess {
    /// Whether only this machine reaches the server.
    pub is_local: bool,
    /// What lets every viewer in.
    pub token: Token,
}

impl ViewerAccess {
    /// Who may connect to a server on `address`.
    #[must_use]
    pub fn on(address: IpAddr, random: [u8; TOKEN_BYTES]) -> Self {
        Self { is_local: address.is_loopback(), token: Token::of(random) }
    }

    /// Whether a viewer may connect: with the token, and on this machine programs, pages of this machine and of the viewers' makers without.
    ///
    /// # Errors
    /// When it may not.
    pub fn check(
        &self,
        host: Option<&str>,
        origin: Option<&str>,
        token: Option<&str>,
    ) -> Result<(), Refusal> {
        if token.is_some_and(|token| self.token.is(token)) {
            return Ok(());
        }
        if !self.is_local {
            return Err(Refusal::Token);
        }
        if !host.is_some_and(is_loopback_name) {
            return Err(Refusal::Host);
        }
        let is_own = |origin: &str| {
            let site = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
            site.is_some_and(is_loopback_name)
        };
        match origin {
            None => Ok(()),
            Some(origin) if VIEWER_SITES.contains(&origin) || is_own(origin) => Ok(()),
            Some(_) => Err(Refusal::Origin),
        }
    }
}

/// Whether a `Host` header names this machine, whatever the port: it may be forwarded.
fn is_loopback_name(host: &str) -> bool {
    LOOPBACK_NAMES.iter().any(|name| {
        let rest = host.get(..name.len()).filter(|start| start.eq_ignore_ascii_case(name));
        let rest = rest.and_then(|_| host.get(name.len()..));
        rest.is_some_and(|rest| {
            let port = rest.strip_prefix(':');
            rest.is_empty()
                || port.is_some_and(|port| {
                    !port.is_empty() && port.bytes().all(|byte| byte.is_ascii_digit())
                })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn on_loopback_only_its_own_names_are_served() {
        let access = Access::on([127, 0, 0, 1].into(), [0; 16]);
        for host in ["localhost", "localhost:8642", "127.0.0.1:1", "[::1]:8642", "LocalHost:9"] {
            assert_eq!(access.check_page(Some(host), None), Ok(()), "{host}");
            let own = format!("http://{host}");
            assert_eq!(access.check_data(Some(host), Some(&own), None), Ok(()), "{host}");
        }
        for host in [
            "evil.example",
            "localhost.evil.example",
            "127.0.0.1.evil.example:80",
            "",
            "localhost:",
            "localhost:8x",
        ] {
            assert_eq!(access.check_page(Some(host), None), Err(Refusal::Host), "{host}");
        }
        assert_eq!(access.check_page(None, None), Err(Refusal::Host));
    }

    #[test]
    fn the_data_are_for_the_own_page() {
        let access = Access::on([127, 0, 0, 1].into(), [0; 16]);
        let host = Some("localhost:8642");
        let others =
            ["http://evil.example", "null", "http://localhost:8643", "http://localhost", "file://"];
        for origin in others {
            assert_eq!(
                access.check_data(host, Some(origin), None),
                Err(Refusal::Origin),
                "{origin}"
            );
        }
        assert_eq!(access.check_data(host, None, None), Err(Refusal::Origin));
    }

    #[test]
    fn a_viewer_of_another_maker_is_let_in_here_or_with_the_token() {
        let here = ViewerAccess::on([127, 0, 0, 1].into(), [5; 16]);
        let host = Some("localhost:8765");
        for origin in [None, Some("https://app.foxglove.dev"), Some("http://localhost:8080")] {
            assert_eq!(here.check(host, origin, None), Ok(()), "{origin:?}");
        }
        for origin in
            ["http://evil.example", "null", "file://", "https://app.foxglove.dev.evil.example"]
        {
            assert_eq!(here.check(host, Some(origin), None), Err(Refusal::Origin), "{origin}");
            assert_eq!(here.check(host, Some(origin), Some(here.token.text())), Ok(()));
        }
        let rebound = Some("evil.example:8765");
        assert_eq!(here.check(rebound, None, None), Err(Refusal::Host));
        let everywhere = ViewerAccess::on([0, 0, 0, 0].into(), [5; 16]);
        assert_eq!(everywhere.check(host, None, None), Err(Refusal::Token));
        assert_eq!(everywhere.check(host, None, Some("5")), Err(Refusal::Token));
        assert_eq!(everywhere.check(Some("robot"), None, Some(everywhere.token.text())), Ok(()));
    }

    #[test]
    fn who_reaches_the_server_from_elsewhere_needs_the_token() {
        let access = Access::on([0, 0, 0, 0].into(), [7; 16]);
        let Access::WithToken(token) = &access else { panic!("no token") };
        assert_eq!(token.text().len(), 32);
        let host = Some("robot:8642");
        let origin = Some("http://robot:8642");
        assert_eq!(access.check_data(host, origin, Some(token.text())), Ok(()));
        let longer = format!("{}0", token.text());
        for wrong in ["", "0", &longer, &token.text()[..31], &token.text().replace('7', "8")] {
            assert_eq!(access.check_page(host, Some(wrong)), Err(Refusal::Token), "{wrong}");
            assert_eq!(access.check_data(host, origin, Some(wrong)), Err(Refusal::Token));
        }
        assert_eq!(access.check_page(host, None), Err(Refusal::Token));
        let foreign = access.check_data(host, Some("http://evil.example"), Some(token.text()));
        assert_eq!(foreign, Err(Refusal::Origin));
        assert!(!format!("{access:?}").contains("0707"));
    }
}

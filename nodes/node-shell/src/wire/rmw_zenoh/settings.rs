//! The choice of Zenoh, and its settings, by the variables that `rmw_zenoh` has.

use crate::wire::transport::TransportError;

/// Names the transport of ROS 2.
pub(crate) const IMPLEMENTATION: &str = "RMW_IMPLEMENTATION";
const ZENOH: &str = "rmw_zenoh_cpp";
const CONFIG_FILE: &str = "ZENOH_SESSION_CONFIG_URI";
const OVERRIDE: &str = "ZENOH_CONFIG_OVERRIDE";
const ROUTER_CHECKS: &str = "ZENOH_ROUTER_CHECK_ATTEMPTS";

/// How a process joins Zenoh.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct ZenohSettings {
    /// The file with the session's configuration, JSON5 or YAML; that of `rmw_zenoh` where there is none.
    pub(crate) config_file: Option<String>,
    /// Keys of the configuration, as `connect/endpoints`, and their values in JSON5, which win over it.
    pub(crate) overrides: Vec<(String, String)>,
    /// How often a router is looked for at the start, a second apart; it goes on without one afterwards.
    pub(crate) router_checks: u64,
}

/// Whether Zenoh is chosen, and its settings. `read` is for variables that are not empty.
///
/// # Errors
/// When a variable is not understood, or this program is built without Zenoh.
pub(crate) fn read(
    read: impl Fn(&'static str) -> Option<String>,
) -> Result<Option<ZenohSettings>, TransportError> {
    let Some(chosen) = read(IMPLEMENTATION).filter(|name| name == ZENOH) else { return Ok(None) };
    if cfg!(not(feature = "zenoh")) {
        let accepted = "an implementation on DDS, as rmw_cyclonedds_cpp, or none: this program is built without Zenoh (cargo \
                        feature `zenoh`)";
        return Err(TransportError::new(IMPLEMENTATION, &chosen, accepted));
    }
    settings(read).map(Some)
}

fn settings(
    read: impl Fn(&'static str) -> Option<String>,
) -> Result<ZenohSettings, TransportError> {
    let overrides = match read(OVERRIDE) {
        None => Vec::new(),
        Some(text) => overrides(&text).ok_or_else(|| {
            let accepted = "keys with their values, as connect/endpoints=[\"tcp/10.0.0.1:7447\"], separated by semicolons";
            TransportError::new(OVERRIDE, &text, accepted)
        })?,
    };
    let router_checks = match read(ROUTER_CHECKS) {
        None => 1,
        Some(text) => match text.parse::<i64>() {
            Ok(0) => u64::MAX,
            Ok(attempts) => u64::try_from(attempts).unwrap_or(0),
            Err(_) => {
                let accepted =
                    "a whole number: of attempts, 0 for as many as it takes, or below 0 for none";
                return Err(TransportError::new(ROUTER_CHECKS, &text, accepted));
            }
        },
    };
    Ok(ZenohSettings { config_file: read(CONFIG_FILE), overrides, router_checks })
}

fn overrides(text: &str) -> Option<Vec<(String, String)>> {
    let items = text.split(';').map(str::trim).filter(|item| !item.is_empty());
    items
        .map(|item| {
            let (key, value) = item.split_once('=')?;
            let (key, value) = (key.trim(), value.trim());
            (!key.is_empty() && !value.is_empty()).then(|| (key.to_owned(), value.to_owned()))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(
        variables: &'static [(&'static str, &'static str)],
    ) -> impl Fn(&'static str) -> Option<String> {
        move |name| {
            variables.iter().find(|(one, _)| *one == name).map(|(_, value)| (*value).to_owned())
        }
    }

    #[test]
    fn zenoh_is_chosen_as_ros_2_chooses_it() {
        assert_eq!(read(of(&[])), Ok(None));
        assert_eq!(read(of(&[(IMPLEMENTATION, "rmw_cyclonedds_cpp")])), Ok(None));
        let chosen = read(of(&[(IMPLEMENTATION, ZENOH)]));
        if cfg!(feature = "zenoh") {
            assert!(chosen.is_ok_and(|settings| settings.is_some()));
        } else {
            // A silent DDS would be heard by nobody.
            let text = chosen.unwrap_err().to_string();
            assert!(text.starts_with("RMW_IMPLEMENTATION=rmw_zenoh_cpp: accepted is "), "{text}");
            assert!(text.contains("built without Zenoh") && !text.contains('\n'), "{text}");
        }
    }

    #[test]
    fn the_variables_of_rmw_zenoh_are_read() {
        let plain = ZenohSettings { config_file: None, overrides: Vec::new(), router_checks: 1 };
        assert_eq!(settings(of(&[])), Ok(plain.clone()));
        let read = settings(of(&[
            (CONFIG_FILE, "/etc/session.json5"),
            (OVERRIDE, "mode=\"client\"; connect/endpoints=[\"tcp/10.0.0.1:7447\"];"),
            (ROUTER_CHECKS, "0"),
        ]));
        let pair = |key: &str, value: &str| (key.to_owned(), value.to_owned());
        let overrides =
            vec![pair("mode", "\"client\""), pair("connect/endpoints", "[\"tcp/10.0.0.1:7447\"]")];
        let config_file = Some("/etc/session.json5".to_owned());
        assert_eq!(read, Ok(ZenohSettings { config_file, overrides, router_checks: u64::MAX }));
        let none = settings(of(&[(ROUTER_CHECKS, "-1")]));
        assert_eq!(none, Ok(ZenohSettings { router_checks: 0, ..plain }));
        for wrong in [&[(ROUTER_CHECKS, "ten")], &[(OVERRIDE, "mode")], &[(OVERRIDE, "=1")]] {
            assert!(settings(of(wrong)).is_err());
        }
    }
}

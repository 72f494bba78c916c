//! Under which names this server answers.
//!
//! A page of somebody else can make a browser believe that its own name leads to this machine (DNS rebinding). The
//! `Host` header then tells the strange name, so every request is held against a list, reads too.

use std::net::SocketAddr;

/// The names, as `host:port`, lower case.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AllowedHosts(Vec<String>);

impl AllowedHosts {
    /// Loopback under its three names at the port that is listened on, the address itself when it is a certain one, and
    /// the names of the configuration (`host` is taken with and without the port, `host:port` as it stands).
    #[must_use]
    pub fn new(listening: SocketAddr, configured: &[String]) -> Self {
        let port = listening.port();
        let mut names: Vec<String> =
            ["127.0.0.1", "localhost", "[::1]"].map(|name| format!("{name}:{port}")).into();
        if !listening.ip().is_unspecified() {
            names.push(listening.to_string());
        }
        for name in configured {
            let name = name.trim().to_ascii_lowercase();
            if has_port(&name) {
                names.push(name);
            } else {
                names.push(format!("{name}:{port}"));
                names.push(name);
            }
        }
        // Browsers leave the usual port out.
        for usual in [":80", ":443"].into_iter().filter(|usual| *usual == format!(":{port}")) {
            let short: Vec<String> =
                names.iter().filter_map(|name| name.strip_suffix(usual)).map(str::to_owned).collect();
            names.extend(short);
        }
        names.sort_unstable();
        names.dedup();
        Self(names)
    }

    /// These names and those of another address, e.g. with TLS.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.0.extend(other.0);
        self.0.sort_unstable();
        self.0.dedup();
        self
    }

    /// Whether a `Host` header says one of these names.
    #[must_use]
    pub fn allows(&self, host: &str) -> bool {
        self.0.binary_search_by(|name| name.as_str().cmp(host.to_ascii_lowercase().as_str())).is_ok()
    }
}

fn has_port(name: &str) -> bool {
    match name.rsplit_once(':') {
        Some((head, port)) => {
            !port.is_empty()
                && port.bytes().all(|b| b.is_ascii_digit())
                && (!head.contains(':') || head.ends_with(']'))
        }
        None => false,
    }
}

/// Whether `origin` is a page of the very server that `host` names, and came to the browser as it should.
pub(super) fn is_same_origin(origin: &str, host: &str, https: bool) -> bool {
    let name = origin.strip_prefix(if https { "https://" } else { "http://" });
    name.is_some_and(|name| name.eq_ignore_ascii_case(host))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hosts(listening: &str, configured: &[&str]) -> AllowedHosts {
        let configured: Vec<String> = configured.iter().map(|s| (*s).to_owned()).collect();
        AllowedHosts::new(listening.parse().unwrap(), &configured)
    }

    #[test]
    fn loopback_has_three_names_and_needs_the_right_port() {
        let hosts = hosts("127.0.0.1:8700", &[]);
        for good in ["127.0.0.1:8700", "localhost:8700", "LOCALHOST:8700", "[::1]:8700"] {
            assert!(hosts.allows(good), "{good}");
        }
        for bad in [
            "localhost",
            "localhost:8701",
            "evil.example:8700",
            "127.0.0.1.evil.example:8700",
            "",
            "localhost:8700 ",
        ] {
            assert!(!hosts.allows(bad), "{bad}");
        }
    }

    #[test]
    fn configured_names_count_with_and_without_the_port() {
        let hosts = hosts("0.0.0.0:8700", &["Ground.example.org", "proxy.example.org:443", "[fd00::1]"]);
        for good in
            ["ground.example.org", "ground.example.org:8700", "proxy.example.org:443", "[fd00::1]:8700"]
        {
            assert!(hosts.allows(good), "{good}");
        }
        assert!(!hosts.allows("proxy.example.org") && !hosts.allows("0.0.0.0:8700"));
    }

    #[test]
    fn at_port_80_the_port_may_be_left_out() {
        assert!(hosts("192.0.2.7:80", &[]).allows("192.0.2.7"));
    }

    #[test]
    fn an_origin_must_name_the_same_host_and_port() {
        assert!(is_same_origin("http://localhost:8700", "localhost:8700", false));
        assert!(is_same_origin("https://ground.example.org", "ground.example.org", true));
        assert!(!is_same_origin("http://ground.example.org", "ground.example.org", true));
        assert!(!is_same_origin("https://ground.example.org", "ground.example.org", false));
        for bad in [
            "null",
            "http://localhost:8701",
            "http://evil.example",
            "file://",
            "http://localhost:8700.evil.example",
        ] {
            assert!(!is_same_origin(bad, "localhost:8700", false), "{bad}");
        }
    }
}

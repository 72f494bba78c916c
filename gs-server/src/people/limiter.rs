//! How often somebody may fail: a bucket per address, and a growing pause per account.
//!
//! Only failures count, so nobody who knows the word is ever held up, but for the account under attack. Memory is
//! bounded: the entry that was used longest ago makes room.

use std::collections::HashMap;
use std::net::IpAddr;

use mission::MonoUs;

/// Addresses, and accounts, that are remembered.
const REMEMBERED: usize = 4096;
/// Failures that an address has in hand.
const ADDRESS_FAILURES: f64 = 20.0;
/// One comes back in so many seconds.
const ADDRESS_REFILL_S: f64 = 15.0;
/// Failures on one account before there is a pause.
const ACCOUNT_FREE: u32 = 5;
/// The longest pause.
const ACCOUNT_PAUSE_MAX_S: u64 = 300;
/// After so long without a failure an account begins anew.
const ACCOUNT_FORGIVEN_S: u64 = 3600;

const SECOND_US: u64 = 1_000_000;

/// Try again after so many seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RetryAfter(pub(super) u64);

#[derive(Debug, Clone, Copy)]
struct Bucket {
    failures: f64,
    at: MonoUs,
}

#[derive(Debug, Clone, Copy)]
struct Pause {
    failures: u32,
    at: MonoUs,
    until: MonoUs,
}

/// What is remembered of failures.
#[derive(Debug, Default)]
pub(super) struct Limiter {
    addresses: HashMap<IpAddr, Bucket>,
    accounts: HashMap<String, Pause>,
}

/// Whoever has one IPv6 address has 2^64 of them.
fn neighbourhood(address: IpAddr) -> IpAddr {
    match address {
        IpAddr::V6(v6) if v6.to_ipv4_mapped().is_none() => {
            let [a, b, c, d, ..] = v6.segments();
            IpAddr::from([a, b, c, d, 0, 0, 0, 0])
        }
        other => other.to_canonical(),
    }
}

impl Limiter {
    /// Whether this address may try.
    pub(super) fn address(&self, now: MonoUs, address: Option<IpAddr>) -> Result<(), RetryAfter> {
        let Some(bucket) = address.and_then(|address| self.addresses.get(&neighbourhood(address))) else {
            return Ok(());
        };
        let left = level(bucket, now);
        if left <= ADDRESS_FAILURES - 1.0 {
            return Ok(());
        }
        Err(RetryAfter(((left - (ADDRESS_FAILURES - 1.0)) * ADDRESS_REFILL_S).ceil().max(1.0) as u64))
    }

    /// Whether this account may be tried.
    pub(super) fn account(&self, now: MonoUs, account: &str) -> Result<(), RetryAfter> {
        match self.accounts.get(account) {
            Some(pause) if pause.until > now => {
                Err(RetryAfter(pause.until.since(now).div_ceil(SECOND_US).max(1)))
            }
            _ => Ok(()),
        }
    }

    /// An address failed.
    pub(super) fn address_failed(&mut self, now: MonoUs, address: Option<IpAddr>) {
        let Some(address) = address.map(neighbourhood) else { return };
        make_room(&mut self.addresses, &address, |bucket| bucket.at);
        let bucket = self.addresses.entry(address).or_insert(Bucket { failures: 0.0, at: now });
        *bucket = Bucket { failures: level(bucket, now) + 1.0, at: now };
    }

    /// A password was wrong on this account, be it there or not.
    pub(super) fn account_failed(&mut self, now: MonoUs, account: &str) {
        let account: String = account.chars().take(64).collect();
        make_room(&mut self.accounts, &account, |pause| pause.at);
        let pause = self.accounts.entry(account).or_insert(Pause { failures: 0, at: now, until: now });
        if now.since(pause.at) > ACCOUNT_FORGIVEN_S * SECOND_US {
            pause.failures = 0;
        }
        pause.failures = pause.failures.saturating_add(1);
        pause.at = now;
        if pause.failures >= ACCOUNT_FREE {
            let doubled = 1_u64 << (pause.failures - ACCOUNT_FREE).min(16);
            pause.until = now.plus(doubled.min(ACCOUNT_PAUSE_MAX_S) * SECOND_US);
        }
    }

    /// The right word was given.
    pub(super) fn account_opened(&mut self, account: &str) {
        self.accounts.remove(account);
    }
}

fn level(bucket: &Bucket, now: MonoUs) -> f64 {
    let seconds = now.since(bucket.at) as f64 / SECOND_US as f64;
    (bucket.failures - seconds / ADDRESS_REFILL_S).max(0.0)
}

fn make_room<K: std::hash::Hash + Eq + Clone, V>(
    map: &mut HashMap<K, V>,
    key: &K,
    at: impl Fn(&V) -> MonoUs,
) {
    if map.len() < REMEMBERED || map.contains_key(key) {
        return;
    }
    let oldest = map.iter().min_by_key(|(_, value)| at(value)).map(|(key, _)| key.clone());
    if let Some(oldest) = oldest {
        map.remove(&oldest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: u64) -> MonoUs {
        MonoUs(seconds * SECOND_US)
    }

    #[test]
    fn an_address_runs_dry_and_recovers() {
        let mut limiter = Limiter::default();
        let address: IpAddr = "192.0.2.7".parse().unwrap();
        for _ in 0..20 {
            assert_eq!(limiter.address(at(0), Some(address)), Ok(()));
            limiter.address_failed(at(0), Some(address));
        }
        assert_eq!(limiter.address(at(0), Some(address)), Err(RetryAfter(15)));
        assert_eq!(limiter.address(at(0), Some("192.0.2.8".parse().unwrap())), Ok(()));
        assert_eq!(limiter.address(at(15), Some(address)), Ok(()));
    }

    #[test]
    fn an_ipv6_neighbourhood_is_one_address() {
        let mut limiter = Limiter::default();
        for host in 0..20_u16 {
            limiter.address_failed(at(0), Some(IpAddr::from([0x2001, 0xdb8, 1, 2, 3, 4, 5, host])));
        }
        assert!(limiter.address(at(0), Some("2001:db8:1:2::99".parse().unwrap())).is_err());
        assert!(limiter.address(at(0), Some("2001:db8:1:3::99".parse().unwrap())).is_ok());
    }

    #[test]
    fn an_account_pauses_longer_and_longer_and_is_forgiven() {
        let mut limiter = Limiter::default();
        for _ in 0..5 {
            assert_eq!(limiter.account(at(0), "verma"), Ok(()));
            limiter.account_failed(at(0), "verma");
        }
        assert_eq!(limiter.account(at(0), "verma"), Err(RetryAfter(1)));
        limiter.account_failed(at(1), "verma");
        assert_eq!(limiter.account(at(1), "verma"), Err(RetryAfter(2)));
        for _ in 0..30 {
            limiter.account_failed(at(3), "verma");
        }
        assert_eq!(limiter.account(at(3), "verma"), Err(RetryAfter(300)));
        assert_eq!(limiter.account(at(3), "other"), Ok(()));
        limiter.account_failed(at(4000), "verma");
        assert_eq!(limiter.account(at(4000), "verma"), Ok(()));
        limiter.account_opened("verma");
        assert!(limiter.accounts.is_empty());
    }

    #[test]
    fn memory_is_bounded() {
        let mut limiter = Limiter::default();
        for n in 0..6000_u32 {
            limiter.address_failed(at(u64::from(n)), Some(IpAddr::from(n.to_be_bytes())));
            limiter.account_failed(at(u64::from(n)), &n.to_string());
        }
        assert_eq!((limiter.addresses.len(), limiter.accounts.len()), (REMEMBERED, REMEMBERED));
        assert!(limiter.accounts.contains_key("5999") && !limiter.accounts.contains_key("0"));
    }
}

//! Finds the addresses by which others reach a socket that listens at all of them (`0.0.0.0`,
//! `[::]`): those of this machine's interfaces, as the kernel lists them. Nobody can open
//! `http://0.0.0.0`.

use std::fs;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

/// The addresses at which others reach `at`. It is only `at` itself, unless `at` means all
/// addresses of this machine: then those of its interfaces, and the loopback address only where
/// there is no interface.
pub fn reachable(at: SocketAddr) -> Vec<SocketAddr> {
    if !at.ip().is_unspecified() {
        return vec![at];
    }
    let read = |path| fs::read_to_string(path).unwrap_or_default();
    let mut found: Vec<IpAddr> = local_v4(&read("/proc/net/fib_trie"));
    if at.is_ipv6() {
        found.extend(global_v6(&read("/proc/net/if_inet6")));
    }
    at_each(found, at.port())
}

fn at_each(mut found: Vec<IpAddr>, port: u16) -> Vec<SocketAddr> {
    if found.is_empty() {
        found.push(Ipv4Addr::LOCALHOST.into());
    }
    let at = |ip| SocketAddr::new(ip, port);
    found.into_iter().map(at).collect()
}

/// The same as a list for people, with `as_text` for each.
pub fn listed(at: SocketAddr, as_text: impl Fn(SocketAddr) -> String) -> String {
    let all: Vec<String> = reachable(at).into_iter().map(as_text).collect();
    all.join(" or ")
}

/// The addresses of this machine's interfaces without the loopback ones, from the kernel's table of
/// routes. Each stands in the line before a line that ends in `host LOCAL`.
fn local_v4(trie: &str) -> Vec<IpAddr> {
    let mut found = Vec::new();
    let mut before = None;
    for line in trie.lines() {
        let line = line.trim();
        if line.ends_with("host LOCAL")
            && let Some(address) = before
            && !found.contains(&address)
        {
            found.push(address);
        }
        let address = line.strip_prefix("|-- ").and_then(|text| text.parse().ok());
        before = address
            .filter(|address: &IpAddr| !address.is_loopback())
            .or(match line.starts_with('/') {
                // An address has several lines, one for each kind of route.
                true => before,
                false => None,
            });
    }
    found
}

/// The IPv6 addresses that other networks can reach: 32 digits, and the scope `00` in the fourth
/// column.
fn global_v6(table: &str) -> Vec<IpAddr> {
    let of = |line: &str| {
        let mut fields = line.split_ascii_whitespace();
        let digits = fields.next()?;
        let is_global = fields.nth(2)? == "00";
        let address = u128::from_str_radix(digits, 16).ok()?;
        is_global.then(|| IpAddr::from(Ipv6Addr::from(address)))
    };
    table.lines().filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIE: &str = "Main:
  +-- 0.0.0.0/0 3 0 5
     |-- 0.0.0.0
        /0 universe UNICAST
     +-- 127.0.0.0/8 2 0 2
        |-- 127.0.0.1
           /32 host LOCAL
     +-- 192.168.1.0/24 2 0 2
        |-- 192.168.1.0
           /24 link UNICAST
        |-- 192.168.1.5
           /32 host LOCAL
        |-- 192.168.1.255
           /32 link BROADCAST
Local:
        |-- 192.168.1.5
           /32 host LOCAL
        |-- 10.0.0.7
           /31 link UNICAST
           /32 host LOCAL
";

    #[test]
    fn the_addresses_of_the_interfaces_are_found_once_each() {
        let found: Vec<String> = local_v4(TRIE).iter().map(IpAddr::to_string).collect();
        assert_eq!(found, ["192.168.1.5", "10.0.0.7"]);
        assert!(local_v4("").is_empty() && local_v4("no table at all").is_empty());
        let table = "\
fe80000000000000505400fffe000001 02 40 20 80     eth0
20010db8000000000000000000000005 02 40 00 80     eth0
00000000000000000000000000000001 01 80 10 80       lo
";
        let found: Vec<String> = global_v6(table).iter().map(IpAddr::to_string).collect();
        assert_eq!(found, ["2001:db8::5"]);
    }

    #[test]
    fn only_an_address_that_stands_for_all_is_replaced() {
        for one in ["127.0.0.1:7410", "192.168.1.5:7410", "[::1]:7410"] {
            let one: SocketAddr = one.parse().expect("an address");
            assert_eq!(reachable(one), [one]);
        }
        for all in ["0.0.0.0:7410", "[::]:7410"] {
            let at = reachable(all.parse().expect("an address"));
            assert!(
                at.iter()
                    .all(|at| !at.ip().is_unspecified() && at.port() == 7410)
            );
            let has_others = at.iter().any(|at| !at.ip().is_loopback());
            let has_own = at.iter().any(|at| at.ip().is_loopback());
            assert!(has_others != has_own, "{at:?}");
        }
    }

    #[test]
    fn each_address_can_be_opened_on_another_computer() {
        let found = ["192.168.1.5", "2001:db8::5"].map(|ip| ip.parse().expect("an address"));
        let told: Vec<String> = at_each(found.into(), 7410)
            .into_iter()
            .map(|at| listed(at, |at| format!("http://{at}/?token=7")))
            .collect();
        assert_eq!(
            told,
            [
                "http://192.168.1.5:7410/?token=7",
                "http://[2001:db8::5]:7410/?token=7"
            ]
        );
        let alone = at_each(Vec::new(), 7410);
        assert_eq!(alone, ["127.0.0.1:7410".parse().expect("an address")]);
    }
}

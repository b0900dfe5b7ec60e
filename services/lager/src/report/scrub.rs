//! Takes out of a text what nobody else may read, before the text leaves the machine.
//!
//! It knows two ways, because each misses something. What is known to be secret (the robot's
//! secret, the panel's tokens, what Wi-Fi and environment hold) is taken out wherever it stands,
//! also escaped. And whatever looks like a secret goes: the rest of a line after a word such as
//! `password`, whatever blanks and quotation marks follow, private keys, hardware addresses, users
//! in addresses of the web, and long words of letters and digits. So it rather takes out too much.
//! Pure.

use std::fmt::Write as _;
use std::path::Path;

/// What stands in the place of a secret.
const LEFT_OUT: &str = "(left out)";

/// Shorter values would tear ordinary words apart.
const SHORTEST: usize = 4;

/// A word of letters and digits of this length is a token or a key.
const OPAQUE: usize = 32;

/// The rest of a line after one of these is secret.
const ALWAYS: [&str; 9] = [
    "password",
    "passwd",
    "passphrase",
    "passwort",
    "psk",
    "ssid",
    "bearer ",
    "authorization",
    "cookie",
];

/// The rest of a line after one of these is secret if a value follows: after `=` or `:`, or after a
/// flag (`--secret FILE`).
const WITH_VALUE: [&str; 8] = [
    "token",
    "secret",
    "credential",
    "api_key",
    "apikey",
    "api-key",
    "private_key",
    "access_key",
];

/// Takes secrets out of texts.
#[derive(Debug, Default)]
pub struct Scrub {
    /// What to replace, and by what; the longest first.
    known: Vec<(String, &'static str)>,
}

impl Scrub {
    /// Takes out these secrets, and the name of the home folder, besides whatever looks secret.
    pub fn new(secrets: impl IntoIterator<Item = String>, home: Option<&Path>) -> Self {
        let mut known = Vec::new();
        for secret in secrets {
            let secret = secret.trim();
            if secret.len() >= SHORTEST {
                let forms = [
                    secret.to_owned(),
                    escaped(secret),
                    escaped(&escaped(secret)),
                    percent(secret),
                ];
                known.extend(forms.into_iter().map(|form| (form, LEFT_OUT)));
            }
        }
        // `/` and `/root` say nothing of a person.
        if let Some(home) = home.filter(|home| home.components().count() > 2) {
            known.push((home.to_string_lossy().into_owned(), "~"));
            if let Some(name) = home.file_name().map(|name| name.to_string_lossy())
                && name.len() >= SHORTEST
                && name != "lager"
            {
                known.push((name.into_owned(), "(user)"));
            }
        }
        known.sort_by_key(|(form, _)| core::cmp::Reverse(form.len()));
        known.dedup();
        Self { known }
    }

    /// The text without what is secret, and in how many places something was taken out.
    pub fn text(&self, text: &str) -> (String, usize) {
        let mut count = 0;
        let mut text = text.to_owned();
        for (form, by) in &self.known {
            count += text.matches(form.as_str()).count();
            text = text.replace(form.as_str(), by);
        }
        let mut clean = String::with_capacity(text.len());
        let mut is_key = false;
        for line in text.split_inclusive('\n') {
            let (line, end) = match line.strip_suffix('\n') {
                Some(line) => (line, "\n"),
                None => (line, ""),
            };
            let begins = line.contains("-----BEGIN");
            if is_key || begins {
                count += usize::from(begins);
                is_key = !line.contains("-----END");
                if begins {
                    clean.push_str(LEFT_OUT);
                    clean.push_str(end);
                }
                continue;
            }
            count += without(line, &mut clean);
            clean.push_str(end);
        }
        (clean, count)
    }
}

/// Writes a line without what looks secret. Returns how much that was.
fn without(line: &str, to: &mut String) -> usize {
    let (line, mut count) = match value(line) {
        Some(at) => (format!("{}{LEFT_OUT}", &line[..at]), 1),
        None => (line.to_owned(), 0),
    };
    let (line, users) = without_users(&line);
    let (line, addresses) = without_addresses(&line);
    count += users + addresses;
    let is_part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '+' | '=');
    let mut rest = line.as_str();
    while let Some(from) = rest.find(is_part) {
        let (before, word) = rest.split_at(from);
        let (word, after) = word.split_at(word.find(|c: char| !is_part(c)).unwrap_or(word.len()));
        to.push_str(before);
        let has = |what: fn(&u8) -> bool| word.bytes().any(|byte| what(&byte));
        let is_opaque =
            word.len() >= OPAQUE && has(u8::is_ascii_digit) && has(u8::is_ascii_alphabetic);
        count += usize::from(is_opaque);
        to.push_str(if is_opaque { LEFT_OUT } else { word });
        rest = after;
    }
    to.push_str(rest);
    count
}

/// Where the secret begins that a word in this line announces.
fn value(line: &str) -> Option<usize> {
    let lower = line.to_ascii_lowercase();
    let is_left_out = |at: usize| line[at..].trim_matches(|c: char| !is_word(c)) == "left out";
    let always = ALWAYS.iter().filter_map(|word| {
        let at = lower.find(word)? + word.len();
        Some(at)
    });
    let with_value = WITH_VALUE.iter().flat_map(|word| {
        lower.match_indices(word).filter_map(|(from, _)| {
            let after = from + word.len();
            let name_ends = lower[after..].find(|c: char| !is_word(c));
            let name_ends = name_ends.map_or(lower.len(), |more| after + more);
            let gap = |c: char| matches!(c, ' ' | '\t' | '"' | '\'' | '\\');
            let sign = lower[name_ends..].trim_start_matches(gap);
            let name_begins = lower[..from].trim_end_matches(is_word).len();
            let is_flag = lower[name_begins..].starts_with("--") && !sign.is_empty();
            (sign.starts_with(['=', ':']) || is_flag).then_some(name_ends)
        })
    });
    let at = always.chain(with_value).min()?;
    let gap = |c: char| matches!(c, ' ' | '\t' | '"' | '\'' | '\\' | '=' | ':');
    let value = line[at..].trim_start_matches(gap);
    let at = line.len() - value.len();
    (!value.is_empty() && !is_left_out(at)).then_some(at)
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || matches!(c, '_' | '-')
}

/// `scheme://user:password@host` without user and password.
fn without_users(line: &str) -> (String, usize) {
    let (mut clean, mut count, mut rest) = (String::new(), 0, line);
    while let Some((before, after)) = rest.split_once("://") {
        clean.push_str(before);
        clean.push_str("://");
        let host = after.find(|c: char| c.is_whitespace() || matches!(c, '/' | '"' | '\''));
        let authority = &after[..host.unwrap_or(after.len())];
        rest = match authority.rfind('@') {
            Some(at) => {
                clean.push_str(LEFT_OUT);
                count += 1;
                &after[at..]
            }
            None => after,
        };
    }
    clean.push_str(rest);
    (clean, count)
}

/// The line without hardware addresses: six pairs of hexadecimal digits.
fn without_addresses(line: &str) -> (String, usize) {
    const LENGTH: usize = 17;
    let bytes = line.as_bytes();
    let is_address = |at: usize| {
        let Some(piece) = bytes.get(at..at + LENGTH) else {
            return false;
        };
        let sign = piece[2];
        let is_it = |(place, byte): (usize, &u8)| match place % 3 {
            2 => *byte == sign,
            _ => byte.is_ascii_hexdigit(),
        };
        let ends = |byte: Option<&u8>| byte.is_none_or(|byte| !byte.is_ascii_hexdigit());
        matches!(sign, b':' | b'-')
            && piece.iter().enumerate().all(is_it)
            && ends(at.checked_sub(1).and_then(|before| bytes.get(before)))
            && ends(bytes.get(at + LENGTH))
    };
    let (mut clean, mut count, mut from, mut at) = (String::new(), 0, 0, 0);
    while at < bytes.len() {
        if is_address(at) {
            clean.push_str(&line[from..at]);
            clean.push_str(LEFT_OUT);
            count += 1;
            at += LENGTH;
            from = at;
        } else {
            at += 1;
        }
    }
    clean.push_str(&line[from..]);
    (clean, count)
}

/// As it stands in JSON and in a trace.
fn escaped(text: &str) -> String {
    let quoted = serde_json::Value::from(text).to_string();
    quoted[1..quoted.len() - 1].to_owned()
}

/// As it stands in an address of the web.
fn percent(text: &str) -> String {
    text.bytes().fold(String::new(), |mut to, byte| {
        let is_plain = byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_' | b'.' | b'~');
        // Writing to a String cannot fail.
        let _ = match is_plain {
            true => write!(to, "{}", byte as char),
            false => write!(to, "%{byte:02X}"),
        };
        to
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A secret with everything at which a pattern may stop.
    const NASTY: &str = "my \"home\" is=my castle";

    fn clean(text: &str) -> String {
        Scrub::default().text(text).0
    }

    #[test]
    fn what_is_known_goes_in_every_form() {
        let scrub = Scrub::new([NASTY.to_owned(), "abc".into()], None);
        let json = serde_json::json!({ "said": NASTY }).to_string();
        let nested = serde_json::json!({ "line": json }).to_string();
        for text in [
            NASTY,
            &json,
            &nested,
            &format!("GET /?q={}", percent(NASTY)),
        ] {
            let (clean, count) = scrub.text(&format!("before {text}\nafter abc"));
            assert!(count > 0 && clean.contains(LEFT_OUT), "{clean}");
            for piece in ["castle", "home", "%22"] {
                assert!(!clean.contains(piece), "{clean}");
            }
            assert!(clean.starts_with("before ") && clean.ends_with("\nafter abc"));
        }
    }

    #[test]
    fn what_looks_secret_goes_to_the_end_of_its_line() {
        for line in [
            format!("password = {NASTY}"),
            format!("wpa password {NASTY}"),
            format!("    psk=\"{NASTY}\""),
            format!("connecting to SSID '{NASTY}'"),
            format!("{{\"token\":\"{NASTY}\",\"x\":1}}"),
            format!("{{\\\"api_key\\\": \\\"{NASTY}\\\"}}"),
            format!("lager comm --secret {NASTY}"),
            format!("LAGER_TOKEN={NASTY}"),
            format!("robots_secret : {NASTY}"),
            format!("Authorization: Bearer {NASTY}"),
            format!("set-cookie: lager-token-7410={NASTY}"),
            format!("the panel is at http://127.0.0.1:7410/?token={NASTY}"),
        ] {
            let clean = clean(&format!("one\n{line}\ntwo"));
            assert!(
                !clean.contains("castle") && !clean.contains("home"),
                "{clean}"
            );
            assert!(
                clean.starts_with("one\n") && clean.ends_with("\ntwo"),
                "{clean}"
            );
        }
    }

    #[test]
    fn keys_addresses_and_users_go_and_what_tells_of_a_fault_stays() {
        let key = "a\n-----BEGIN PRIVATE KEY-----\nAAAA\nBBBB\n-----END PRIVATE KEY-----\nb";
        assert_eq!(clean(key), format!("a\n{LEFT_OUT}\nb"));
        assert_eq!(
            clean("x\n-----BEGIN KEY-----\nAAAA"),
            format!("x\n{LEFT_OUT}\n")
        );
        let address = "wlan0 b8:27:eb:01:02:03 and B8-27-EB-01-02-03.";
        assert_eq!(clean(address), format!("wlan0 {LEFT_OUT} and {LEFT_OUT}."));
        let user = "mqtt://anna:geheim@hall.example/x";
        assert_eq!(clean(user), format!("mqtt://{LEFT_OUT}@hall.example/x"));
        let token = "at 0123456789abcdef0123456789abcdef now";
        assert_eq!(clean(token), format!("at {LEFT_OUT} now"));
        for stays in [
            "2026-11-28 20:44:19.123 ERROR bridge: /dev/lager-steering: no such file",
            "[serial]\nbaud = 500000\nsensor = \"/dev/serial/by-id/usb-FTDI_FT232R-if00-port0\"",
            "the robot's folder has no secret",
            "frames 12 34 56 78 90 12 34 56 78",
            "lager 0.1.0, iceoryx2 0.10.0, Linux 6.1.0-rpi7-rpi-v8",
        ] {
            assert_eq!(Scrub::default().text(stays), (stays.to_owned(), 0));
        }
    }

    #[test]
    fn nobody_learns_the_name_of_a_person_from_a_path() {
        let scrub = Scrub::new([], Some(Path::new("/home/annika")));
        let (clean, _) = scrub.text("cannot read /home/annika/hall.toml; annika owns it");
        assert_eq!(clean, "cannot read ~/hall.toml; (user) owns it");
        let root = Scrub::new([], Some(Path::new("/root")));
        assert_eq!(root.text("/root/x of root").0, "/root/x of root");
    }
}

//! What somebody may have meant who has mistyped a word: the nearest of those that there are.
//!
//! It is for error sentences only. Nothing acts upon a guess.

/// The candidate that `word` is most like, if one is like it at all: at most a third of the longer
/// word, and at least one letter, is changed, added, left out or exchanged with the one beside it.
/// Of several that are as near the first one counts. Upper and lower case are the same here.
///
/// ```
/// use lager_lines::nearest;
///
/// assert_eq!(nearest("sied", ["id", "name", "square", "side"]), Some("side"));
/// assert_eq!(nearest("nav/statsu", ["nav/route", "nav/status"]), Some("nav/status"));
/// assert_eq!(nearest("colour", ["id", "name", "square", "side"]), None);
/// ```
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let letters = |word: &str| word.to_lowercase().chars().collect::<Vec<_>>();
    let word = letters(word);
    let near = candidates.into_iter().filter_map(|candidate| {
        let other = letters(candidate);
        let most = (word.len().max(other.len()) / 3).max(1);
        let distance = distance(&word, &other);
        // A word of which nothing is left is like every other.
        let is_like = distance <= most && distance < word.len().max(other.len());
        is_like.then_some((distance, candidate))
    });
    // Of equal ones `min_by_key` takes the first.
    near.min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// The name that was meant, where a serde error tells that one is unknown and which there are.
///
/// ```
/// let why = "unknown field `sied`, expected one of `id`, `square`, `side`";
/// assert_eq!(lager_lines::meant(why), Some("side"));
/// assert_eq!(lager_lines::meant("invalid type: string"), None);
/// ```
pub fn meant(message: &str) -> Option<&str> {
    let (_, names) = message
        .split_once("unknown field `")
        .or_else(|| message.split_once("unknown variant `"))?;
    // What stands between every other pair of marks: the typed one, and those that there are.
    let mut quoted = names.split('`').step_by(2);
    let typed = quoted.next()?;
    nearest(typed, quoted)
}

/// What such an error is to be followed by: `; did you mean `side`?`, or nothing if no name that
/// would have been right is like it.
pub fn hint(message: &str) -> String {
    meant(message).map_or_else(String::new, |meant| format!("; did you mean `{meant}`?"))
}

/// How many letters have to be changed, added, left out or exchanged with the next one.
fn distance(from: &[char], to: &[char]) -> usize {
    // Three rows of the table suffice: an exchange looks two back.
    let mut before_last: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=to.len()).collect();
    for (i, a) in from.iter().enumerate() {
        let mut row = vec![i + 1];
        for (j, b) in to.iter().enumerate() {
            let changed = last[j] + usize::from(a != b);
            let mut least = changed.min(last[j + 1] + 1).min(row[j] + 1);
            if i > 0 && j > 0 && from[i - 1] == *b && *a == to[j - 1] {
                least = least.min(before_last[j - 1] + 1);
            }
            row.push(least);
        }
        before_last = core::mem::replace(&mut last, row);
    }
    last[to.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistyped_word_finds_the_one_that_was_meant() {
        let keys = ["size", "side_length_cm", "delivery", "product"];
        for (typed, meant) in [
            ("products", Some("product")),
            ("Product", Some("product")),
            ("delivrey", Some("delivery")),
            ("side_length", Some("side_length_cm")),
            ("siez", Some("size")),
            ("exit", None),
            ("", None),
        ] {
            assert_eq!(nearest(typed, keys), meant, "{typed}");
        }
    }

    #[test]
    fn nothing_is_like_a_word_of_which_nothing_is_left() {
        assert_eq!(nearest("x", ["y"]), None);
        assert_eq!(nearest("x", ["x"]), Some("x"));
        assert_eq!(nearest("smal", ["small", "large"]), Some("small"));
    }

    #[test]
    fn an_exchange_counts_once() {
        let letters = |word: &str| word.chars().collect::<Vec<_>>();
        assert_eq!(distance(&letters("sied"), &letters("side")), 1);
        assert_eq!(distance(&letters(""), &letters("side")), 4);
        assert_eq!(distance(&letters("kitten"), &letters("sitting")), 3);
    }
}

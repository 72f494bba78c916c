//! System calls as `strace -f -tt -y` tells them: who, what, when it began, when it ended.

use std::collections::HashMap;

/// A system call. Begin and end are places in the trace: a lower one came first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// Its name.
    pub name: String,
    /// Its arguments, as strace writes them.
    pub arguments: String,
    /// Where it began.
    pub began: usize,
    /// Where it ended.
    pub ended: usize,
}

impl Call {
    /// Whether it is one of these, on a file whose path ends so (or, for strings among the arguments, contains so).
    #[must_use]
    pub fn is(&self, names: &[&str], path: &str) -> bool {
        names.contains(&self.name.as_str()) && self.arguments.contains(path)
    }
}

/// Calls that ended well, in the order of their beginnings.
#[must_use]
pub fn calls(trace: &str) -> Vec<Call> {
    let mut open: HashMap<(&str, &str), (usize, &str)> = HashMap::new();
    let mut calls = Vec::new();
    for (place, line) in trace.lines().enumerate() {
        let Some((thread, text)) = line.split_once(' ').and_then(|(thread, rest)| {
            // A time of day stands before the call.
            Some((thread, rest.trim_start().split_once(' ')?.1))
        }) else {
            continue;
        };
        if let Some(rest) = text.strip_prefix("<... ") {
            let Some((name, rest)) = rest.split_once(" resumed>") else { continue };
            if let Some((began, head)) = open.remove(&(thread, name)) {
                keep(&mut calls, name, &format!("{head}{rest}"), began, place);
            }
        } else if let Some((name, rest)) = text.split_once('(') {
            match rest.strip_suffix(" <unfinished ...>") {
                Some(head) => drop(open.insert((thread, name), (place, head))),
                None => keep(&mut calls, name, rest, place, place),
            }
        }
    }
    calls.sort_by_key(|call| call.began);
    calls
}

fn keep(calls: &mut Vec<Call>, name: &str, rest: &str, began: usize, ended: usize) {
    let Some((arguments, result)) = rest.rsplit_once(" = ") else { return };
    if !result.starts_with('-') {
        calls.push(Call { name: name.to_owned(), arguments: arguments.to_owned(), began, ended });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_that_was_interrupted_by_another_thread_is_one() {
        let trace = "7 10:00:00.000001 fsync(3</a/b> <unfinished ...>\n\
                     8 10:00:00.000002 write(4</dev/pts/1>, \"x = y\", 5) = 5\n\
                     7 10:00:00.000003 <... fsync resumed>) = 0\n\
                     7 10:00:00.000004 fsync(3</a/c>) = -1 EIO (Input/output error)\n";
        let calls = calls(trace);
        assert_eq!(calls.len(), 2, "{calls:?}");
        assert_eq!((calls[0].name.as_str(), calls[0].began, calls[0].ended), ("fsync", 0, 2));
        assert!(calls[0].is(&["fsync"], "</a/b>") && calls[1].is(&["write"], "x = y"));
    }
}

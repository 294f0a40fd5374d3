//! How derived templates are renumbered: the parts of `mirror-x` and `reverse-yarn` that only concern
//! labels and edge numbers, shared by every template format.
//!
//! `mirror-x` turns a face over sideways. So that a face keeps starting with the edges it started with,
//! the new numbering begins at the far end of the leading run of like edges.

/// One operation of a `derive`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    /// `mirror-x`: u becomes -u and the edges are renumbered.
    MirrorX,
    /// `mirror-z`: z becomes -z.
    MirrorZ,
    /// `reverse-yarn`: the yarn's edges swap in and out; points stay.
    ReverseYarn,
}

impl Operation {
    /// The names, for messages.
    pub const NAMES: &'static str = "'mirror-x', 'mirror-z' or 'reverse-yarn'";

    /// The operation of a name in a template file.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "mirror-x" => Some(Self::MirrorX),
            "mirror-z" => Some(Self::MirrorZ),
            "reverse-yarn" => Some(Self::ReverseYarn),
            _ => None,
        }
    }
}

/// Length of the leading run of edges with the direction and type of edge 0, the type taken without its
/// trailing digits. None if all edges are alike (then `mirror-x` has nowhere to begin) or there are none.
pub fn mirror_x_run<S: AsRef<str>>(labels: &[S]) -> Option<usize> {
    let kind = |label: &S| label.as_ref().trim_end_matches(|c: char| c.is_ascii_digit()).to_owned();
    let first = kind(labels.first()?);
    labels.iter().position(|label| kind(label) != first)
}

/// Where edge `edge` of a face with `count` edges comes to lie under `mirror-x`: (run - edge - 1) mod
/// count. Its own inverse, so it also says which source edge a new edge was. A place `along` the edge
/// becomes 1 - `along`.
///
/// Needs `edge < count` and `run < count`.
pub fn mirror_x_edge(edge: usize, run: usize, count: usize) -> usize {
    (run + count - edge - 1) % count
}

/// Which source corner a new corner is under `mirror-x`: (run - corner) mod count; its u is negated. Its
/// own inverse.
///
/// Needs `corner < count` and `run < count`.
pub fn mirror_x_corner(corner: usize, run: usize, count: usize) -> usize {
    (run + count - corner) % count
}

/// The labels after `mirror-x`.
pub fn mirror_x_labels(labels: &[String], run: usize) -> Vec<String> {
    let count = labels.len();
    (0..count).map(|edge| labels[mirror_x_edge(edge, run, count)].clone()).collect()
}

/// The labels after `reverse-yarn`: `+y...` and `-y...` swap their signs, all others stay.
pub fn reverse_yarn_labels(labels: &[String]) -> Vec<String> {
    labels
        .iter()
        .map(|label| match label.split_at_checked(1) {
            Some(("+", kind)) if kind.starts_with('y') => format!("-{kind}"),
            Some(("-", kind)) if kind.starts_with('y') => format!("+{kind}"),
            _ => label.clone(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split(' ').map(str::to_owned).collect()
    }

    #[test]
    fn runs_ignore_trailing_digits_only() {
        assert_eq!(mirror_x_run(&words("-l1 -l2 +y -y")), Some(2));
        assert_eq!(mirror_x_run(&words("-lX -l1 +y -y")), Some(1));
        assert_eq!(mirror_x_run(&words("-l +l -l")), Some(1));
        assert_eq!(mirror_x_run(&words("x x1 x2")), None);
        assert_eq!(mirror_x_run(&words("1 23 +y")), Some(2));
        assert_eq!(mirror_x_run::<String>(&[]), None);
    }

    #[test]
    fn mirroring_twice_changes_nothing() {
        for count in 3..9 {
            for run in 1..count {
                for k in 0..count {
                    assert_eq!(mirror_x_edge(mirror_x_edge(k, run, count), run, count), k);
                    assert_eq!(mirror_x_corner(mirror_x_corner(k, run, count), run, count), k);
                    // Edge k runs from corner k to k + 1; mirrored it runs the other way round.
                    let edge = mirror_x_edge(k, run, count);
                    assert_eq!(mirror_x_corner((k + 1) % count, run, count), edge);
                    assert_eq!(mirror_x_corner(k, run, count), (edge + 1) % count);
                }
            }
        }
    }

    #[test]
    fn labels_are_renumbered() {
        let labels = words("-lX -lX +yX +lX -yX");
        assert_eq!(mirror_x_labels(&labels, 2), words("-lX -lX -yX +lX +yX"));
        assert_eq!(reverse_yarn_labels(&labels), words("-lX -lX -yX +lX +yX"));
        assert_eq!(reverse_yarn_labels(&words("y +y -y1 +ly é +é")), words("y -y +y1 +ly é +é"));
    }
}

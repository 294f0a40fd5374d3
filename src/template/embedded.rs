//! The template files that come with the program.

/// Name and text of each file of `templates/`.
pub(super) const FILES: &[(&str, &str)] = &[
    ("templates/knit.json", include_str!("../../templates/knit.json")),
    ("templates/purl.json", include_str!("../../templates/purl.json")),
];

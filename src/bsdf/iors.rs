//! Transparent matter by name: indices of refraction at the sodium line (589.3 nm), relative to vacuum.
//!
//! Source: common handbook values under the names that Mitsuba's scene files use.

/// Index of refraction of the matter of that name (one of [`names`], in any case).
pub fn lookup(name: &str) -> Option<f64> {
    let found = IORS.iter().find(|(n, _)| n.eq_ignore_ascii_case(name));
    found.map(|&(_, index)| index)
}

/// All names, in alphabetical order.
pub fn names() -> impl Iterator<Item = &'static str> {
    IORS.iter().map(|&(name, _)| name)
}

/// Sorted by name.
static IORS: &[(&str, f64)] = &[
    ("acetone", 1.36),
    ("acrylic glass", 1.49),
    ("air", 1.000277),
    ("amber", 1.55),
    ("benzene", 1.501),
    ("bk7", 1.5046),
    ("bromine", 1.661),
    ("carbon dioxide", 1.00045),
    ("carbon tetrachloride", 1.461),
    ("diamond", 2.419),
    ("ethanol", 1.361),
    ("fused quartz", 1.458),
    ("glycerol", 1.4729),
    ("helium", 1.000036),
    ("hydrogen", 1.000132),
    ("pet", 1.575),
    ("polypropylene", 1.49),
    ("pyrex", 1.47),
    ("silicone oil", 1.52045),
    ("sodium chloride", 1.544),
    ("vacuum", 1.0),
    ("water", 1.333),
    ("water ice", 1.31),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_is_sorted_and_found() {
        assert!(IORS.is_sorted_by(|a, b| a.0 < b.0));
        for name in names() {
            assert!(
                lookup(name).is_some_and(|eta| (1.0..3.0).contains(&eta)),
                "{name}"
            );
        }
        assert_eq!(lookup("bk7"), Some(1.5046));
        assert_eq!(lookup("Water Ice"), Some(1.31));
        assert_eq!(lookup("glass"), None);
    }
}

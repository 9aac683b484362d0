//! Files of version 0.x and 1.x (Mitsuba 0.6 and before) brought to today's names, as Mitsuba 3 does:
//! every `name` becomes snake_case, `diffuse_reflectance` of a diffuse BSDF is its `reflectance`, and
//! offsets and scales of texture coordinates become the transform `to_uv`.

use super::super::desc::{Given, Mark, Value};
use super::super::error::Span;
use crate::math::{DVec3, Transform};

/// camelCase to snake_case: capitals that follow a small letter. `intIOR` becomes `int_ior`, while a
/// name that starts with a capital stays.
pub fn snake_case(name: &str) -> String {
    let mut out = String::with_capacity(name.len() + 4);
    // True inside a run of capitals that began after a small letter.
    let mut in_run = false;
    let mut last = ' ';
    for c in name.chars() {
        let starts = c.is_ascii_uppercase() && last.is_ascii_lowercase();
        in_run = c.is_ascii_uppercase() && (in_run || starts);
        if starts {
            out.push('_');
        }
        out.push(if in_run { c.to_ascii_lowercase() } else { c });
        last = c;
    }
    out
}

/// Renames a parameter of a plugin, given in snake_case already; `taken` tells whether it also has
/// the parameter of the new name.
pub fn rename<'a>(plugin: &str, name: &'a str, taken: bool) -> &'a str {
    match (plugin, name) {
        ("diffuse", "diffuse_reflectance") if !taken => "reflectance",
        _ => name,
    }
}

/// Replaces `uoffset`, `voffset`, `uscale`, `vscale` by one `to_uv` that shifts, then scales.
///
/// The error is the place of the first of them when a scale is zero.
pub fn texture_coordinates(params: &mut Vec<Given>) -> Result<(), Span> {
    let mut numbers = [1.0, 1.0, 0.0, 0.0];
    let mut first: Option<Given> = None;
    let mut i = 0;
    while i < params.len() {
        let names = ["uscale", "vscale", "uoffset", "voffset"];
        let slot = names.iter().position(|n| *n == params[i].name);
        let number = match params[i].value {
            Value::Float(x) => Some(x),
            Value::Int(x) => Some(x as f64),
            _ => None,
        };
        let (Some(slot), Some(number)) = (slot, number) else {
            i += 1;
            continue;
        };
        numbers[slot] = number;
        let given = params.remove(i);
        first.get_or_insert(given);
    }
    let [su, sv, ou, ov] = numbers;
    let shift = Transform::translate(DVec3::new(ou, ov, 0.0));
    let Some(first) = first else {
        return Ok(());
    };
    let scale = Transform::scale(DVec3::new(su, sv, 1.0)).ok_or(first.value_at)?;
    params.push(Given {
        name: "to_uv".into(),
        value: Value::Transform(Box::new(scale * shift)),
        name_at: first.name_at,
        value_at: first.value_at,
        read: Mark::default(),
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_snake_case_as_in_mitsuba() {
        for (old, new) in [
            ("toWorld", "to_world"),
            ("intIOR", "int_ior"),
            ("fooURLbar", "foo_urlbar"),
            ("aBcD", "a_bc_d"),
            ("xX2Y", "x_x2Y"),
            ("a1B", "a1B"),
            ("URLFoo", "URLFoo"),
            ("varyTextureXY", "vary_texture_xy"),
            ("B", "B"),
            ("srgb", "srgb"),
        ] {
            assert_eq!(snake_case(old), new);
        }
    }
}

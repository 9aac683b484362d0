//! The table as text, for `luxel info --plugins`.

use super::{Category, Default, Plugin, all};
use std::fmt::Write;

/// All plugins with their parameters, types, defaults and meaning, by category.
pub fn reference() -> String {
    let mut text = String::new();
    for category in Category::ALL {
        let mut rows = all().filter(|p| p.category == category).peekable();
        if rows.peek().is_some() {
            let _ = writeln!(text, "{category}");
            rows.for_each(|plugin| write_plugin(&mut text, plugin));
        }
    }
    text
}

/// Writing to a string cannot fail, so the results are dropped.
fn write_plugin(text: &mut String, plugin: &Plugin) {
    let _ = writeln!(text, "  {}: {}", plugin.name, plugin.doc);
    for p in plugin.params {
        let default = match p.default {
            Default::Required => "required".into(),
            Default::Absent => "optional".into(),
            Default::Int(i) => format!("default {i}"),
            Default::Float(x) => format!("default {x}"),
            Default::Bool(b) => format!("default {b}"),
            Default::Text(t) => format!("default \"{t}\""),
            Default::Point([x, y, z]) => format!("default ({x}, {y}, {z})"),
            Default::Identity => "default identity".into(),
        };
        let kind = p.kind.describe();
        let _ = writeln!(text, "    {} ({kind}; {default}): {}", p.name, p.doc);
    }
    for slot in plugin.slots {
        let count = match (slot.min, slot.max) {
            (0, 1) => "at most one".into(),
            (0, usize::MAX) => "any number of".into(),
            (min, max) if min == max => format!("exactly {min}"),
            (min, max) => format!("{min} to {max}"),
        };
        let _ = writeln!(text, "    holds {count} <{}>", slot.category);
    }
}

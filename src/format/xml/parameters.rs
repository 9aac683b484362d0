//! `<default>`, `-D` and `$name`.

use super::super::error::{Place, SceneError, command_line, did_you_mean, list};
use super::super::limits;
use std::collections::BTreeMap;
use std::ops::Bound;

/// The parameters of a scene, by name.
#[derive(Debug, Default)]
pub struct Parameters {
    values: BTreeMap<String, Parameter>,
    /// Bytes of all text that was filled in.
    filled_in: usize,
}

#[derive(Debug)]
struct Parameter {
    value: String,
    /// Position among the `-D` of the command line.
    from_command_line: Option<usize>,
    used: bool,
}

impl Parameters {
    /// Starts with what the command line gives.
    pub fn new(defines: &[(String, String)]) -> Result<Parameters, SceneError> {
        let mut values = BTreeMap::new();
        for (i, (name, value)) in defines.iter().enumerate() {
            if name.is_empty() || name.contains('$') {
                return Err(SceneError::new(
                    define(defines, i),
                    format!("\"{name}\" cannot be the name of a parameter"),
                ));
            }
            let parameter = Parameter {
                value: value.clone(),
                from_command_line: Some(i),
                used: false,
            };
            if values.insert(name.clone(), parameter).is_some() {
                return Err(SceneError::new(
                    define(defines, i),
                    format!("parameter \"{name}\" is given twice"),
                ));
            }
        }
        Ok(Parameters {
            values,
            filled_in: 0,
        })
    }

    /// A `<default>`: the first value given to a name stays, that of the command line before all.
    pub fn set_default(&mut self, name: &str, value: &str) {
        if !self.values.contains_key(name) {
            let parameter = Parameter {
                value: value.to_string(),
                from_command_line: None,
                used: false,
            };
            self.values.insert(name.to_string(), parameter);
        }
    }

    /// Replaces each `$name`, taking the longest known name. Values are not looked into again.
    ///
    /// Errors are the message and its help.
    pub fn fill_in(&mut self, text: &str) -> Result<String, (String, String)> {
        let mut out = String::new();
        let mut rest = text;
        while let Some(dollar) = rest.find('$') {
            out.push_str(&rest[..dollar]);
            rest = &rest[dollar + 1..];
            let Some(name) = self.longest_name(rest) else {
                return Err(self.undefined(rest));
            };
            rest = &rest[name.len()..];
            let Some(parameter) = self.values.get_mut(&name) else {
                continue;
            };
            parameter.used = true;
            out.push_str(&parameter.value);
            self.filled_in += parameter.value.len();
            if self.filled_in > limits::FILLED_IN_BYTES {
                return Err((
                    "the values of parameters grow too long".into(),
                    format!(
                        "at most {} MiB may be filled in, all together",
                        limits::FILLED_IN_BYTES >> 20
                    ),
                ));
            }
        }
        out.push_str(rest);
        Ok(out)
    }

    /// The longest known name that `rest` begins with.
    fn longest_name(&self, rest: &str) -> Option<String> {
        // Names that begin `rest` sort before it; each miss shortens what the next may be.
        let mut bound = rest;
        loop {
            let up_to = (Bound::Unbounded, Bound::Included(bound));
            let (name, _) = self.values.range::<str, _>(up_to).next_back()?;
            if rest.starts_with(name.as_str()) {
                return Some(name.clone());
            }
            let same = |((i, a), b): &((usize, char), char)| (a == b).then_some(i + a.len_utf8());
            let common = bound.char_indices().zip(name.chars());
            let end = common.map_while(|pair| same(&pair)).last().unwrap_or(0);
            bound = &bound[..end];
        }
    }

    fn undefined(&self, rest: &str) -> (String, String) {
        let word = |c: &char| c.is_alphanumeric() || *c == '_';
        let name: String = rest.chars().take_while(word).collect();
        let known = || self.values.keys().map(String::as_str);
        let help = did_you_mean(&name, known()).unwrap_or_else(|| {
            if self.values.is_empty() {
                format!("define it before with <default name=\"{name}\" value=\"...\"/>, or with -D {name}=...")
            } else {
                format!("known here are {}", list(known()))
            }
        });
        (format!("undefined parameter \"${name}\""), help)
    }

    /// An error for the first `-D` that no `$name` has used.
    pub fn check_used(&self, defines: &[(String, String)]) -> Result<(), SceneError> {
        let unused = self
            .values
            .iter()
            .filter(|(_, p)| !p.used)
            .filter_map(|(name, p)| p.from_command_line.map(|i| (i, name)))
            .min();
        let Some((i, name)) = unused else {
            return Ok(());
        };
        let known = || {
            let others = self.values.iter().filter(|(_, p)| p.used);
            others.map(|(name, _)| name.as_str())
        };
        let help = did_you_mean(name, known()).unwrap_or_else(|| match known().next() {
            None => "the scene has no parameters".into(),
            Some(_) => format!("the parameters of the scene are {}", list(known())),
        });
        let what = format!("the scene does not use the parameter \"{name}\"");
        Err(SceneError::new(define(defines, i), what).with_help(help))
    }
}

/// Shows a `-D` as if it stood in a file.
/// The place of the i-th of the `-D`.
fn define(defines: &[(String, String)], i: usize) -> Place {
    let (name, value) = &defines[i];
    command_line("-D", &format!("{name}={value}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_replaced_longest_first() {
        let mut p = Parameters::new(&[]).unwrap();
        p.set_default("a", "1");
        p.set_default("ab", "2");
        p.set_default("a", "3");
        p.set_default("abz", "9");
        p.set_default("ac", "9");
        p.set_default("b", "9");
        assert_eq!(p.fill_in("x$a-$ab-b $abc$a.obj").unwrap(), "x1-2-b 2c1.obj");
        assert_eq!(p.fill_in("none").unwrap(), "none");
        assert_eq!(p.fill_in("$c").unwrap_err().0, "undefined parameter \"$c\"");
        assert_eq!(p.fill_in("ä$").unwrap_err().0, "undefined parameter \"$\"");
    }
}

//! The findings of a study as data: JSON with everything, CSV with a line per setting.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::evaluate::{Row, common_scale};
use super::fit::{Bias, Convergence, FitPoint, Forecast};
use super::flip_floor;
use super::plan::{FORMAT, Study, StudyError};
use super::reference::TIMES_BELOW;
use super::statistics::Estimate;
use super::sweep::Findings;
use crate::image_io::write_atomic;

/// Names of the files in the folder.
pub const JSON_NAME: &str = "results.json";
pub const CSV_NAME: &str = "results.csv";

/// Everything, as `results.json` has it. Errors, biases and noise are relative (roots of relMSE and of its
/// parts) where nothing else is said; an interval is of 95 %.
pub fn to_json(study: &Study, findings: &Findings) -> Value {
    let plan = &study.plan;
    let window = study.methods[0].job.film.crop;
    let methods: Vec<Value> = (0..study.methods.len())
        .map(|m| method_json(study, findings, m))
        .collect();
    let rows = findings.rows.iter();
    let points: Vec<Value> = rows.map(|row| row_json(study, findings, row)).collect();
    let known = &findings.reference;
    let below = known.path.strip_prefix(&plan.folder);
    let file = below.unwrap_or(&known.path).to_string_lossy().into_owned();
    json!({
        "luxel_study": FORMAT,
        "version": env!("CARGO_PKG_VERSION"),
        "scene": plan.scene,
        "command": plan.command_line,
        "identity": plan.identity_json()["of"],
        "resolution": [window.width, window.height],
        "threads": plan.threads,
        "runs": plan.runs,
        "reference": {
            "file": file,
            "method": known.method,
            "spp": known.spp,
            "seconds": known.seconds,
            "relmse": known.rel_mse,
            "error": known.rel_mse.map(f64::sqrt),
            // No number where there is no error at all.
            "times_below": findings.times_below,
            "ten_times_below": findings.times_below.map(|t| t >= TIMES_BELOW),
            "flip_floor": findings.flip_floor,
        },
        "findings": findings.remarks,
        "methods": methods,
        "points": points,
    })
}

/// A number with its interval; `null` for what is not finite.
fn estimate(e: Estimate) -> Value {
    json!({ "value": e.value, "ci95": [e.low, e.high] })
}

fn method_json(study: &Study, findings: &Findings, m: usize) -> Value {
    let method = &study.methods[m];
    let of_method = findings.rows.iter().filter(|r| r.method == m);
    let points: Vec<FitPoint> = of_method.map(Row::fit_point).collect();
    let c = Convergence::of(&points, method.job.integrator.biased());
    let line = |l: &super::fit::Line| {
        json!({
            "slope": l.slope.value,
            "ci95": [l.slope.low, l.slope.high],
            // Ends of the line, to draw it.
            "ends": points.first().zip(points.last()).map(|(a, b)| {
                json!([[a.spp, l.at(a.spp)], [b.spp, l.at(b.spp)]])
            }),
        })
    };
    let forecasts = study.plan.wanted.iter();
    let forecasts: Vec<Value> = forecasts
        .map(|w| forecast_json(*w, c.forecast(*w)))
        .collect();
    json!({
        "label": method.label,
        "integrator": method.job.integrator.name(),
        "biased": method.job.integrator.biased(),
        "render": format!("luxel render {}", method.arguments),
        "error_slope": c.error.as_ref().map(line),
        "noise_slope": c.noise.as_ref().map(line),
        "bias": c.bias.map(bias_json),
        "exact": c.exact,
        "seconds_before": c.seconds.map(|s| s[0]),
        "seconds_per_sample": c.seconds.map(|s| s[1]),
        "forecasts": forecasts,
    })
}

fn bias_json(bias: Bias) -> Value {
    match bias {
        Bias::NotSeen { below } => json!({ "kind": "not seen", "below": below }),
        Bias::Falls { last, line } => {
            json!({ "kind": "falls", "last": estimate(last), "slope": estimate(line.slope) })
        }
        Bias::Stays { last, floor_spp } => {
            json!({ "kind": "stays", "last": estimate(last), "floor_spp": floor_spp })
        }
    }
}

fn forecast_json(wanted: f64, forecast: Forecast) -> Value {
    let (kind, more) = match forecast {
        Forecast::Exact => ("exact", json!({})),
        Forecast::Unknown(why) => ("unknown", json!({ "why": why.to_string() })),
        Forecast::NeverBelow(bias) => ("never", json!({ "bias": bias })),
        Forecast::Reached { spp, seconds } => (
            "reached",
            json!({ "spp": estimate(spp), "seconds": estimate(seconds) }),
        ),
    };
    let mut value = json!({ "wanted": wanted, "kind": kind });
    if let (Value::Object(to), Value::Object(from)) = (&mut value, more) {
        to.extend(from);
    }
    value
}

fn row_json(study: &Study, findings: &Findings, row: &Row) -> Value {
    let plan = &study.plan;
    let (method, amount) = (&study.methods[row.method], plan.amounts[row.amount]);
    let run = |(i, (record, [relmse, flip])): (usize, (&super::runs::Record, &[f64; 2]))| {
        let file = plan.run_file(method, amount, i);
        let file = file.strip_prefix(&plan.folder).unwrap_or(&file);
        json!({
            "seed": record.seed,
            "spp": record.spp,
            "seconds": record.seconds,
            "rays": record.rays,
            "peak_memory_bytes": record.memory,
            "invalid_samples": record.invalid,
            "relmse": relmse,
            "flip": flip,
            "claimed_relmse": record.claimed,
            "file": file.to_string_lossy(),
        })
    };
    let each: Vec<Value> = row
        .records
        .iter()
        .zip(&row.each)
        .enumerate()
        .map(run)
        .collect();
    let image = |what: &str| format!("images/{}-{what}", row.stem);
    let first = row.records.first().map_or(0, |r| r.seed);
    json!({
        "method": method.label,
        "amount": amount.to_string(),
        "command": format!("luxel render {} {} --seed {first}", method.arguments, amount.arguments()),
        "spp": row.spp,
        "seconds": estimate(row.seconds),
        "rays": row.rays,
        "peak_memory_bytes": row.memory,
        "error": estimate(row.error()),
        "bias": estimate(row.relative.bias2.root()),
        "noise": estimate(row.relative.variance.root()),
        "relmse": estimate(row.relative.mse),
        "bias_squared": estimate(row.relative.bias2),
        "variance": estimate(row.relative.variance),
        "rmse": estimate(row.absolute.mse.root()),
        "rmse_bias": estimate(row.absolute.bias2.root()),
        "rmse_noise": estimate(row.absolute.variance.root()),
        "brightness": row.brightness.map(estimate),
        "flip": estimate(row.flip),
        // Too near to what the reference's noise makes alone.
        "flip_resolved": findings.flip_floor.is_none_or(|floor| {
            row.flip.value == 0.0 && floor == 0.0 || row.flip.value >= flip_floor::RESOLVED * floor
        }),
        "efficiency": row.efficiency().map(estimate),
        "claims_held": row.claims_held(findings.reference.rel_mse.unwrap_or(0.0)),
        "front": row.front,
        "images": {
            "mean": image("mean.exr"),
            "mean_png": image("mean.png"),
            "run": image("run.png"),
            "error": image("error.png"),
            "bias": image("bias.png"),
            "scale": common_scale(&findings.rows, row.amount),
        },
        "runs": each,
    })
}

/// Columns of the CSV: its name, and where the value stands in a point of the JSON.
const COLUMNS: [(&str, &str); 33] = [
    ("method", "/method"),
    ("amount", "/amount"),
    ("spp", "/spp"),
    ("seconds", "/seconds/value"),
    ("seconds_low", "/seconds/ci95/0"),
    ("seconds_high", "/seconds/ci95/1"),
    ("rays", "/rays"),
    ("peak_memory_bytes", "/peak_memory_bytes"),
    ("error", "/error/value"),
    ("error_low", "/error/ci95/0"),
    ("error_high", "/error/ci95/1"),
    ("bias", "/bias/value"),
    ("bias_low", "/bias/ci95/0"),
    ("bias_high", "/bias/ci95/1"),
    ("noise", "/noise/value"),
    ("noise_low", "/noise/ci95/0"),
    ("noise_high", "/noise/ci95/1"),
    ("relmse", "/relmse/value"),
    ("relmse_low", "/relmse/ci95/0"),
    ("relmse_high", "/relmse/ci95/1"),
    ("rmse", "/rmse/value"),
    ("rmse_low", "/rmse/ci95/0"),
    ("rmse_high", "/rmse/ci95/1"),
    ("brightness", "/brightness/value"),
    ("brightness_low", "/brightness/ci95/0"),
    ("brightness_high", "/brightness/ci95/1"),
    ("flip", "/flip/value"),
    ("flip_low", "/flip/ci95/0"),
    ("flip_high", "/flip/ci95/1"),
    ("flip_resolved", "/flip_resolved"),
    ("efficiency", "/efficiency/value"),
    ("front", "/front"),
    ("command", "/command"),
];

/// A line per point of the JSON, with a head (RFC 4180; empty where there is no number).
pub fn to_csv(json: &Value) -> String {
    let names: Vec<&str> = COLUMNS.iter().map(|(name, _)| *name).collect();
    let mut out = names.join(",");
    out.push('\n');
    for point in json["points"].as_array().into_iter().flatten() {
        for (i, (_, at)) in COLUMNS.iter().enumerate() {
            let comma = if i > 0 { "," } else { "" };
            let cell = match point.pointer(at) {
                None | Some(Value::Null) => String::new(),
                Some(Value::String(text)) => quoted(text),
                Some(other) => other.to_string(),
            };
            // Writing to a string cannot fail.
            let _ = write!(out, "{comma}{cell}");
        }
        out.push('\n');
    }
    out
}

fn quoted(text: &str) -> String {
    match text.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_string(),
    }
}

/// Writes both files.
///
/// # Errors
/// They cannot be written.
pub fn write(study: &Study, json: &Value) -> Result<(), StudyError> {
    let folder = &study.plan.folder;
    write_atomic(&folder.join(JSON_NAME), format!("{json:#}\n").as_bytes())?;
    write_atomic(&folder.join(CSV_NAME), to_csv(json).as_bytes())?;
    Ok(())
}

/// A few lines for people: of each method the slope, the bias, and what the wanted errors take.
pub fn summary(json: &Value) -> Vec<String> {
    let methods = json["methods"].as_array().into_iter().flatten();
    methods.map(method_line).collect()
}

/// With so many decimals; in powers of ten where that would make a long row of digits, or leave nothing.
fn short(v: f64, decimals: usize) -> String {
    let least = 0.5 * 10f64.powi(-(decimals as i32));
    match v == 0.0 || (least..1e12).contains(&v.abs()) || !v.is_finite() {
        true => format!("{v:.decimals$}"),
        false => format!("{v:.2e}"),
    }
}

fn method_line(method: &Value) -> String {
    let number = |v: &Value| v.as_f64().unwrap_or(f64::NAN);
    let percent = |v: &Value| format!("{} %", short(100.0 * number(v), 2));
    let slope = match &method["error_slope"] {
        Value::Null if method["exact"] == true => "slope none".to_string(),
        Value::Null => "no slope from one setting".to_string(),
        line => format!(
            "slope {:.3} (95 %: {:.3} to {:.3})",
            number(&line["slope"]),
            number(&line["ci95"][0]),
            number(&line["ci95"][1])
        ),
    };
    let bias = &method["bias"];
    let bias = match bias["kind"].as_str() {
        _ if method["exact"] == true => "no error".to_string(),
        Some("not seen") => format!("bias not seen, below {}", percent(&bias["below"])),
        Some("falls") => format!(
            "bias {} and falling, slope {:.2}",
            percent(&bias["last"]["value"]),
            number(&bias["slope"]["value"])
        ),
        Some(_) => match bias["floor_spp"].as_f64() {
            Some(spp) => format!(
                "bias {}, more than noise from {} spp",
                percent(&bias["last"]["value"]),
                short(spp, 0)
            ),
            None => format!("bias {}", percent(&bias["last"]["value"])),
        },
        None => "bias unknown".to_string(),
    };
    let forecast = |f: &Value| {
        let wanted = format!("{} %", short(100.0 * number(&f["wanted"]), 3));
        match f["kind"].as_str() {
            Some("reached") => format!(
                "{wanted} takes {} spp, {} s",
                short(number(&f["spp"]["value"]).max(1.0), 0),
                short(number(&f["seconds"]["value"]), 2)
            ),
            Some("never") => format!("{wanted} is below its bias"),
            Some("exact") => format!("{wanted} is reached at once"),
            _ => match f["why"].as_str() {
                Some(why) => format!("{wanted}: no forecast ({why})"),
                None => format!("{wanted}: no forecast"),
            },
        }
    };
    let forecasts = method["forecasts"].as_array().into_iter().flatten();
    let mut parts = vec![slope, bias];
    parts.extend(forecasts.map(forecast));
    format!(
        "{}: {}",
        method["label"].as_str().unwrap_or(""),
        parts.join("; ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_whatever_their_size() {
        assert_eq!(
            (short(1.0, 3), short(0.0, 2)),
            ("1.000".into(), "0.00".into())
        );
        assert_eq!(
            (short(1e300, 3), short(1e-7, 3)),
            ("1.00e300".into(), "1.00e-7".into())
        );
        let forecast =
            json!({ "wanted": 1e298, "kind": "unknown", "why": "bias may be as large as 3.00 %" });
        let line = method_line(&json!({ "label": "sppm", "forecasts": [forecast] }));
        assert!(
            line.ends_with("1.00e300 %: no forecast (bias may be as large as 3.00 %)"),
            "{line}"
        );
    }

    #[test]
    fn cells_with_commas_are_quoted_and_missing_ones_empty() {
        let json = json!({ "points": [{
            "method": "a \"b\", c",
            "spp": 4,
            "error": { "value": 0.5, "ci95": [0.25, null] },
        }] });
        let csv = to_csv(&json);
        let line = csv.lines().nth(1).unwrap();
        assert!(
            line.starts_with("\"a \"\"b\"\", c\",,4,,,,,,0.5,0.25,,"),
            "{line}"
        );
        assert_eq!(line.matches(',').count(), COLUMNS.len());
    }
}

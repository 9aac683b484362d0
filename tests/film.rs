//! What the film of a scene says: filters, channels of the picture and how they are stored.

#[path = "common/render.rs"]
mod render;

use luxel::image_io::{Layer, Samples};
use luxel::render::Metadata;

fn scene(film: &str, content: &str) -> String {
    format!(
        r#"<scene version="3.0.0">
            <integrator type="path"/>
            <sensor type="perspective"><float name="fov" value="50"/>
                <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
                <film type="hdrfilm">
                    <integer name="width" value="16"/><integer name="height" value="16"/>{film}
                </film>
            </sensor>{content}
        </scene>"#
    )
}

/// Kind, parameters, radius, and values at 0, 0.3, 0.8, 1.3, 1.9 and 2.6 pixels (Mitsuba 3.9.1).
#[rustfmt::skip]
const FILTERS: [(&str, &str, [f32; 7]); 10] = [
    ("box", "", [0.5, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
    ("tent", "", [1.0, 1.0, 0.7, 0.2, 0.0, 0.0, 0.0]),
    ("tent", "radius 1.7", [1.7, 1.0, 0.823529, 0.529412, 0.235294, 0.0, 0.0]),
    ("gaussian", "", [2.0, 0.999247, 0.835048, 0.277601, 0.0337046, 0.000387882, 0.0]),
    ("gaussian", "stddev 0.9", [3.6, 0.99925, 0.945433, 0.673559, 0.351939, 0.107357, 0.0150574]),
    ("mitchell", "", [2.0, 0.888889, 0.740389, 0.206222, -0.0299445, -0.00294425, 0.0]),
    ("mitchell", "B 0.1 C 0.6", [2.0, 0.966667, 0.802417, 0.198667, -0.0824839, -0.00538374, 0.0]),
    ("catmullrom", "", [2.0, 1.0, 0.8155, 0.168, -0.0735003, -0.00450023, 0.0]),
    ("lanczos", "", [3.0, 1.0, 0.844343, 0.20746, -0.14233, -0.0237699, 0.0173938]),
    ("lanczos", "lobes 2", [2.0, 1.0, 0.826975, 0.177001, -0.0864335, -0.00271355, 0.0]),
];

#[test]
fn filters_have_measured_values() {
    for (kind, parameters, figures) in FILTERS {
        let words: Vec<&str> = parameters.split_whitespace().collect();
        let tag = |name: &str| if name == "lobes" { "integer" } else { "float" };
        let parameters: String = words
            .chunks(2)
            .map(|p| format!(r#"<{} name="{}" value="{}"/>"#, tag(p[0]), p[0], p[1]))
            .collect();
        let film = format!(r#"<rfilter type="{kind}">{parameters}</rfilter>"#);
        let filter = render::compile(&scene(&film, "")).job.film.filter;
        assert!((filter.radius() - figures[0]).abs() < 1e-6, "{kind}");
        for (x, figure) in [0.0, 0.3, 0.8, 1.3, 1.9, 2.6]
            .into_iter()
            .zip(&figures[1..])
        {
            // Mitsuba's Gaussian is a polynomial that stays within 5e-4 of one.
            let tolerance = if kind == "gaussian" { 5e-4 } else { 2e-6 };
            let value = filter.eval(x);
            assert!(
                (value - figure).abs() < tolerance,
                "{filter:?} at {x}: {value}"
            );
        }
    }
}

/// The colours of a picture of a ball in front of nothing.
fn colors(pixel_format: &str, component_format: &str) -> Layer {
    let film = format!(
        r#"<string name="pixel_format" value="{pixel_format}"/>
            <string name="component_format" value="{component_format}"/><rfilter type="box"/>"#
    );
    let ball = r#"<shape type="sphere"><bsdf type="diffuse"/>
        <emitter type="area"><rgb name="radiance" value="0.9, 0.5, 0.2"/></emitter></shape>"#;
    let compiled = render::compile(&scene(&film, ball));
    let (film, stats) = render::render(&compiled, 16);
    let metadata = Metadata {
        scene: String::new(),
        scene_hash: String::new(),
        command_line: String::new(),
    };
    compiled
        .job
        .picture(&film, &stats, &metadata)
        .layers
        .remove(0)
}

/// Channels by pixel format, and their values where the ball covers a pixel: X, Y and Z are those of the
/// primaries of Rec. 709 under D65.
#[test]
fn pixels_have_the_channels_of_their_format() {
    let rgb: [f32; 3] = [0.9, 0.5, 0.2];
    let row = |m: [f32; 3]| m.iter().zip(rgb).map(|(m, c)| m * c).sum::<f32>();
    let y = row([0.212671, 0.715160, 0.072169]);
    let xyz = [
        row([0.412453, 0.357580, 0.180423]),
        y,
        row([0.019334, 0.119193, 0.950227]),
    ];
    let formats: [(&str, &str, Vec<f32>); 6] = [
        ("rgb", "RGB", rgb.to_vec()),
        ("rgba", "RGBA", [&rgb[..], &[1.0]].concat()),
        ("luminance", "Y", vec![y]),
        ("luminance_alpha", "YA", vec![y, 1.0]),
        ("xyz", "XYZ", xyz.to_vec()),
        ("xyza", "XYZA", [&xyz[..], &[1.0]].concat()),
    ];
    for (pixel_format, names, values) in formats {
        for component_format in ["float32", "float16"] {
            let layer = colors(pixel_format, component_format);
            let found: String = layer.channels.iter().map(|c| c.name.as_str()).collect();
            assert_eq!(found, names);
            for (channel, value) in layer.channels.iter().zip(&values) {
                let half = matches!(channel.samples, Samples::Half(_));
                assert_eq!(half, component_format == "float16", "{pixel_format}");
                let (corner, center) = (channel.samples.get(0), channel.samples.get(8 * 16 + 8));
                assert_eq!(corner, 0.0, "{pixel_format} {}", channel.name);
                assert!(
                    (center - value).abs() < 1e-5,
                    "{pixel_format} {}: {center}",
                    channel.name
                );
            }
            // Beside the edge, alpha is the share of the pixel that is covered.
            if let Some(alpha) = layer.channels.iter().find(|c| c.name == "A") {
                let partly = (0..256).filter(|&i| (0.01..0.99).contains(&alpha.samples.get(i)));
                assert!(partly.count() > 20);
            }
        }
    }
}

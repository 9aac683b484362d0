//! Rooms in which all surfaces shine and reflect alike: B = E / (1 - albedo) on all of them, whatever their form.

use crate::{render, solve};
use luxel::radiosity::SolveSpec;

/// The inside of a cube, the inside of a ball, and a cube with a block that stands in it.
const ROOMS: [&str; 3] = [
    r#"<shape type="cube"><boolean name="flip_normals" value="true"/>MORE</shape>"#,
    r#"<shape type="sphere"><boolean name="flip_normals" value="true"/>MORE</shape>"#,
    r#"<shape type="cube"><boolean name="flip_normals" value="true"/>MORE</shape>
    <shape type="cube"><transform name="to_world"><scale x="0.3" y="0.5" z="0.2"/><rotate y="1" angle="20"/>
    <translate x="0.2" y="-0.1" z="0.3"/></transform>MORE</shape>"#,
];

/// With an albedo of 0.999 it takes 9,200 steps, each of which lets through that much.
const RESIDUAL: f64 = 1e-4;
/// In the mean over the area: of light straight from emitters, which is everywhere here, by links of an error of 1e-2
/// and by walks of which a patch has some hundreds. What is reflected errs no more, however often that happens.
const NOISE: f64 = 5e-3;
/// Share of rays that may slip out between two surfaces: six of a million did.
const LOST: f64 = 1e-5;

#[test]
fn links_keep_the_light_of_bright_furnaces() {
    for room in ROOMS {
        for albedo in [0.99, 0.999] {
            // Radiance 1 is an exitance of π.
            let more = format!(
                "<bsdf type='diffuse'><rgb name='reflectance' value='{albedo}'/></bsdf>\
                 <emitter type='area'><rgb name='radiance' value='1'/></emitter>"
            );
            let room = room.replace("MORE", &more);
            let xml = format!("<scene version='3.0.0'><sensor type='perspective'/>{room}</scene>");
            let spec = SolveSpec {
                error: 1e-2,
                residual: RESIDUAL,
                ..SolveSpec::default()
            };
            let solution = solve(&render::compile(&xml).job.scene, &spec);
            assert!(solution.report.converged);
            // The scene is held in f32.
            let expected = std::f64::consts::PI / (1.0 - f64::from(albedo as f32));
            let mut sums = [0.0; 2];
            for (patch, b) in solution.mesh.patches.iter().zip(&solution.radiosity) {
                let off = (*b / expected - 1.0).abs().max_element();
                sums[0] += patch.area * off;
                sums[1] += patch.area;
            }
            let off = sums[0] / sums[1];
            assert!(
                off < NOISE + RESIDUAL + LOST / (1.0 - albedo),
                "{albedo}: off by {off}"
            );
        }
    }
}

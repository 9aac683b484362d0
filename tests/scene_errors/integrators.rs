//! Integrators that walk from lights.

use super::*;

/// The error of an integrator, which stands on line 3.
fn of(integrator: &str) -> String {
    building(&format!("<sensor type='perspective'/>\n{integrator}"))
}

#[test]
fn what_is_not_supported_says_what_to_do() {
    says(
        of("<integrator type='ppm'/>"),
        r#"
a.xml:3:13: integrator "ppm" is not supported
  <integrator type='ppm'/>
              ^
  help: use the integrator "sppm", which shoots photons for every pass and keeps none"#,
    );
    for name in ["mlt", "pssmlt", "erpt"] {
        let text = of(&format!("<integrator type='{name}'/>"));
        let help = r#"help: luxel mutates no paths; use the integrator "bdpt" or "vcm""#;
        assert!(text.contains(help), "{text}");
    }
    says(
        of("<integrator type='bdpt'><boolean name='sample_direct' value='false'/></integrator>"),
        r#"
a.xml:3:55: bidirectional path tracing without samples of emitters is not supported
  <integrator type='bdpt'><boolean name='sample_direct' value='false'/></integrator>
                                                        ^
  help: leave "sample_direct" out: each technique weighs most where it is good"#,
    );
    says(
        of("<integrator type='sppm'><integer name='max_passes' value='8'/></integrator>"),
        r#"
a.xml:3:52: a number of passes in the integrator is not supported
  <integrator type='sppm'><integer name='max_passes' value='8'/></integrator>
                                                     ^
  help: set the sampler's sample_count or --spp: a pass is a sample of each pixel"#,
    );
}

#[test]
fn memory_for_photons() {
    let body = "<sensor type='perspective'/>\n\
        <integrator type='vcm'><integer name='photon_count' value='100000000'/><integer name='memory' value='1'/></integrator>\n\
        <shape type='sphere'><bsdf type='diffuse'/></shape>\n\
        <shape type='sphere'><float name='radius' value='9'/><boolean name='flip_normals' value='true'/>\
        <bsdf type='diffuse'/></shape>\n\
        <emitter type='point'><point name='position' x='3' y='0' z='0'/></emitter>";
    let text = building(body);
    let start = "a.xml:3:13: photon_count 100000000 makes about ";
    assert!(text.starts_with(start), "{text}");
    let end = "help: shoot fewer photons, or set \"memory\" of the integrator, in MiB";
    assert!(text.ends_with(end), "{text}");
}

#[test]
fn settings_of_photons() {
    says(
        of("<integrator type='vcm'><float name='alpha' value='1'/></integrator>"),
        r#"
a.xml:3:44: "alpha" must be a number above 0 and below 1, not 1
  <integrator type='vcm'><float name='alpha' value='1'/></integrator>
                                             ^"#,
    );
    says(
        of("<integrator type='sppm'><integer name='photon_count' value='0'/></integrator>"),
        r#"
a.xml:3:54: "photon_count" must be an integer of at least 1, not 0
  <integrator type='sppm'><integer name='photon_count' value='0'/></integrator>
                                                       ^"#,
    );
    says(
        of("<integrator type='sppm'><float name='initial_radius' value='-1'/></integrator>"),
        r#"
a.xml:3:54: "initial_radius" must be a number of at least 0, not -1
  <integrator type='sppm'><float name='initial_radius' value='-1'/></integrator>
                                                       ^"#,
    );
    says(
        of("<integrator type='bdpt'><float name='initial_radius' value='1'/></integrator>"),
        r#"
a.xml:3:32: unknown parameter "initial_radius" of integrator "bdpt"
  <integrator type='bdpt'><float name='initial_radius' value='1'/></integrator>
                                 ^
  help: known are "max_depth", "rr_depth", "hide_emitters", "light_image", "sample_direct", "samples_per_pass", "timeout" and "block_size""#,
    );
}

#[test]
fn light_cannot_be_connected_to_a_meter() {
    says(
        building(
            "<sensor type='radiancemeter'><film type='hdrfilm'><integer name='width' value='1'/>\
             <integer name='height' value='1'/></film></sensor>\n<integrator type='ptracer'/>",
        ),
        r#"
a.xml:3:13: the integrator "ptracer" cannot connect light to the sensor "radiancemeter"
  <integrator type='ptracer'/>
              ^
  help: use "bdpt", "vcm" or "path", which also walk from the sensor"#,
    );
    let asked = Overrides {
        integrator: Some("ptracer".into()),
        ..Overrides::default()
    };
    let body = "<sensor type='distant'><film type='hdrfilm'><integer name='width' value='1'/>\
                <integer name='height' value='1'/></film></sensor>\n<integrator type='path'/>\n<shape type='sphere'/>";
    says(
        building_in(Path::new("nowhere"), body, &asked),
        r#"
command line:1:14: the integrator "ptracer" cannot connect light to the sensor "distant"
  --integrator ptracer
               ^
  help: use "bdpt", "vcm" or "path", which also walk from the sensor"#,
    );
}

#[test]
fn radiosity_without_use_or_effect() {
    says(
        of(
            "<integrator type='path'><string name='indirect' value='guide'/>\n<string name='solver' value='gauss'/></integrator>",
        ),
        r#"
a.xml:4:23: the solver "gauss" makes no links that walks could be guided by
  <string name='solver' value='gauss'/></integrator>
                        ^
  help: use the solver "hierarchical""#,
    );
    says(
        of("<integrator type='path'><string name='solver' value='gauss'/></integrator>"),
        r#"
a.xml:3:47: "solver" has no effect without radiosity
  <integrator type='path'><string name='solver' value='gauss'/></integrator>
                                                ^
  help: leave it out, or set "indirect" to "gather" or "guide""#,
    );
    says(
        of(
            "<integrator type='radiosity'><string name='solver' value='gauss'/><float name='error' value='1'/></integrator>",
        ),
        r#"
a.xml:3:87: "error" has no effect with the solver "gauss"
  <integrator type='radiosity'><string name='solver' value='gauss'/><float name='error' value='1'/></integrator>
                                                                                        ^
  help: leave it out, or use the solver "hierarchical""#,
    );
    says(
        of("<integrator type='radiosity'><integer name='resolution' value='64'/></integrator>"),
        r#"
a.xml:3:57: "resolution" has no effect with form factors by "analytic"
  <integrator type='radiosity'><integer name='resolution' value='64'/></integrator>
                                                          ^
  help: use "samples""#,
    );
    says(
        of("<integrator type='radiosity'><string name='show' value='smooth'/></integrator>"),
        r#"
a.xml:3:50: "show" must be one of "flat", "gouraud", "gather", not "smooth"
  <integrator type='radiosity'><string name='show' value='smooth'/></integrator>
                                                   ^"#,
    );
    let asking = |integrator: Option<&str>, indirect: &str| {
        let asked = Overrides {
            integrator: integrator.map(str::to_string),
            indirect: Some(indirect.to_string()),
            ..Overrides::default()
        };
        building_in(Path::new("nowhere"), "<sensor type='perspective'/>", &asked)
    };
    says(
        asking(Some("bdpt"), "gather"),
        r#"
command line:1:12: the integrator "bdpt" finds indirect light in its own way
  --indirect gather
             ^
  help: leave --indirect out, or give --integrator path or combined"#,
    );
    says(
        asking(None, "gahter"),
        r#"
command line:1:12: unknown way "gahter" to find indirect light
  --indirect gahter
             ^
  help: did you mean "gather"?"#,
    );
}

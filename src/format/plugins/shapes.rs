//! Shapes.

use super::{Category, Kind, Param, Plugin, Range, Slot};

const FLIP: Param = Param::bool("flip_normals", false, "Turn the normals to the other side.");
const TO_WORLD: Param = Param::motion("to_world", "Places the shape in the world.");
const SILHOUETTE: Param = Param::float(
    "silhouette_sampling_weight",
    Range::NonNegative,
    1.0,
    "For differentiable rendering; without effect here.",
);
const END: Param = Param::optional(
    "filename_end",
    Kind::File,
    "The same mesh with its vertices where they are when the shutter closes; they move on straight lines.",
);
const FACE: Param = Param::bool(
    "face_normals",
    false,
    "Shade with the normals of the faces instead of smooth ones.",
);
const SLOTS: &[Slot] = &[
    Slot::new(Category::Bsdf, 0, 1),
    Slot::new(Category::Emitter, 0, 1),
    Slot::new(Category::Sensor, 0, 1),
];

const fn shape(name: &'static str, params: &'static [Param], doc: &'static str) -> Plugin {
    Plugin {
        slots: SLOTS,
        ..Plugin::new(Category::Shape, name, params, doc)
    }
}

pub const PLUGINS: &[Plugin] = &[
    shape(
        "obj",
        &[
            Param::file("filename", "The Wavefront OBJ file."),
            END,
            FACE,
            Param::bool(
                "flip_tex_coords",
                true,
                "Use 1 - v for the second texture coordinate.",
            ),
            FLIP,
            TO_WORLD,
            SILHOUETTE,
        ],
        "Triangle mesh of a Wavefront OBJ file; smooth normals are computed if it has none.",
    ),
    shape(
        "ply",
        &[
            Param::file("filename", "The PLY file, ASCII or binary."),
            END,
            FACE,
            Param::bool(
                "flip_tex_coords",
                false,
                "Use 1 - v for the second texture coordinate.",
            ),
            FLIP,
            TO_WORLD,
            SILHOUETTE,
        ],
        "Triangle mesh of a PLY file; smooth normals are computed if it has none.",
    ),
    shape(
        "serialized",
        &[
            Param::file("filename", "The file of serialized meshes, version 3 or 4."),
            Param::int(
                "shape_index",
                (0, i32::MAX as i64),
                0,
                "Which mesh of the file, from 0.",
            ),
            FACE,
            FLIP,
            TO_WORLD,
            SILHOUETTE,
        ],
        "Triangle mesh of a file made by Mitsuba; smooth normals are computed if it has none.",
    ),
    shape(
        "sdfgrid",
        &[
            Param::file("filename", "The grid of signed distances, a .vol file."),
            Param::choice(
                "normals",
                &["smooth", "analytic"],
                "smooth",
                "Shade with normals that are smoothed between voxels, or with the exact ones.",
            ),
            TO_WORLD,
            SILHOUETTE,
        ],
        "Where a grid of distances over the cube from (0, 0, 0) to (1, 1, 1) is zero; gives no light.",
    ),
    shape(
        "rectangle",
        &[FLIP, FACE, TO_WORLD, SILHOUETTE],
        "The square from (-1, -1, 0) to (1, 1, 0) with normal +z.",
    ),
    shape(
        "cube",
        &[FLIP, FACE, TO_WORLD, SILHOUETTE],
        "The cube from (-1, -1, -1) to (1, 1, 1) with normals outwards.",
    ),
    shape(
        "sphere",
        &[
            Param::point("center", [0.0; 3], "Centre."),
            Param::float("radius", Range::Positive, 1.0, "Radius."),
            FLIP,
            TO_WORLD,
            SILHOUETTE,
        ],
        "Sphere with normals outwards.",
    ),
    shape(
        "disk",
        &[FLIP, TO_WORLD, SILHOUETTE],
        "The disk of radius 1 in the plane z = 0 with normal +z.",
    ),
    shape(
        "cylinder",
        &[
            Param::point("p0", [0.0, 0.0, 0.0], "Centre of one end."),
            Param::point("p1", [0.0, 0.0, 1.0], "Centre of the other end."),
            Param::float("radius", Range::Positive, 1.0, "Radius."),
            FLIP,
            TO_WORLD,
            SILHOUETTE,
        ],
        "Cylinder without caps, with normals outwards.",
    ),
    Plugin {
        slots: &[Slot::new(Category::Shape, 0, usize::MAX)],
        ..Plugin::new(
            Category::Shape,
            "shapegroup",
            &[],
            "Shapes that are not there by themselves, but wherever an instance places them.",
        )
    },
    Plugin {
        slots: &[Slot::new(Category::Shape, 1, 1)],
        ..Plugin::new(
            Category::Shape,
            "instance",
            &[
                Param::motion("to_world", "Places the group in the world."),
                SILHOUETTE,
            ],
            "The shapes of a shapegroup, in one more place.",
        )
    },
];

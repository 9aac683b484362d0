//! Pictures survive their files, files survive failed writes, and no file makes a reader panic.

use std::fs;
use std::path::{Path, PathBuf};

use luxel::image_io::{
    Bitmap, Channel, Encoding, Image, ImageError, Layer, Pixels, Samples, read_metadata,
};
use luxel::math::Rgb;

/// A folder of its own for each test, removed at its end.
struct Folder(PathBuf);

impl Folder {
    fn new(test: &str) -> Folder {
        let name = format!("luxel-image-{}-{test}", std::process::id());
        let path = std::env::temp_dir().join(name);
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.0).unwrap();
        let name = |e: std::io::Result<fs::DirEntry>| e.unwrap().file_name();
        entries
            .map(|e| name(e).to_string_lossy().into_owned())
            .collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Smooth, coloured, partly above 1, with an exact zero at the origin.
fn picture(width: usize, height: usize) -> Vec<Rgb> {
    let colour = |i: usize| {
        let (x, y) = ((i % width) as f32, (i / width) as f32);
        Rgb::new(x / width as f32, y / height as f32, 0.01 * x * y)
    };
    (0..width * height).map(colour).collect()
}

fn layered() -> Image {
    let (width, height) = (13, 7);
    let n = width * height;
    let rgb = picture(width, height);
    let mut image = Image::from_rgb(width, height, &rgb);
    image
        .layers
        .push(Layer::from_rgb("stderr", &rgb, Samples::Float));
    image.layers.push(Layer::from_scalar(
        "spp",
        Samples::Uint((0..n as u32).map(|i| u32::MAX - i).collect()),
    ));
    image.layers.push(Layer {
        name: "normal".to_string(),
        channels: ["X", "Y", "Z"]
            .iter()
            .map(|name| Channel {
                name: name.to_string(),
                samples: Samples::Half(vec![0.5; n]),
            })
            .collect(),
    });
    image.metadata = Some(r#"{"scene":"K\u00fcche","spp":64}"#.to_string());
    image
}

#[test]
fn exr_keeps_layers_types_and_metadata() {
    let folder = Folder::new("layers");
    let path = folder.file("a.exr");
    let image = layered();
    image.write(&path).unwrap();
    assert_eq!(Image::read(&path).unwrap(), image);
    assert_eq!(read_metadata(&path).unwrap(), image.metadata);
    assert_eq!(folder.names(), ["a.exr"], "no temporary file stays behind");
}

#[test]
fn equal_images_give_equal_files() {
    let folder = Folder::new("bytes");
    let image = layered();
    for name in ["a.exr", "b.exr", "c.exr"] {
        image.write(folder.file(name)).unwrap();
    }
    let first = fs::read(folder.file("a.exr")).unwrap();
    for name in ["b.exr", "c.exr"] {
        assert_eq!(fs::read(folder.file(name)).unwrap(), first);
    }
}

#[test]
fn crops_remember_their_place_in_the_frame() {
    let folder = Folder::new("crop");
    let path = folder.file("crop.exr");
    let mut image = layered();
    image.offset = [5, 3];
    image.frame = [64, 48];
    image.write(&path).unwrap();
    assert_eq!(Image::read(&path).unwrap(), image);
}

#[test]
fn metadata_outside_ascii_are_escaped_not_lost() {
    let folder = Folder::new("unicode");
    let path = folder.file("a.exr");
    let mut image = layered();
    image.metadata = Some(r#"{"scene":"Küche 🙂"}"#.to_string());
    image.write(&path).unwrap();
    let read: serde_json::Value =
        serde_json::from_str(&read_metadata(&path).unwrap().unwrap()).unwrap();
    assert_eq!(read["scene"], "Küche 🙂");
}

#[test]
fn a_bitmap_of_a_layered_file_is_its_picture() {
    let folder = Folder::new("foreign");
    let path = folder.file("a.exr");
    layered().write(&path).unwrap();
    let bitmap = Bitmap::read(&path).unwrap();
    let raw: Vec<f32> = picture(13, 7).iter().flat_map(|c| c.to_array()).collect();
    assert_eq!((bitmap.channels, bitmap.encoding), (3, Encoding::Linear));
    assert_eq!(bitmap.pixels, Pixels::F32(raw));
}

#[test]
fn png_is_srgb_at_exposure_zero() {
    let folder = Folder::new("png");
    let path = folder.file("a.png");
    let greys = [0.0, 0.0031308, 0.2140411, 1.0, 7.0, -1.0, f32::NAN];
    let pixels = greys.map(Rgb::splat);
    Image::from_rgb(7, 1, &pixels).write(&path).unwrap();
    let bitmap = Bitmap::read(&path).unwrap();
    assert_eq!(bitmap.encoding, Encoding::Srgb);
    let bytes: Vec<u8> = [0, 10, 127, 255, 255, 0, 0]
        .iter()
        .flat_map(|&b| [b; 3])
        .collect();
    // 0.2140411 is the linear value of the encoded 0.5, which may round either way.
    match bitmap.pixels {
        Pixels::U8(read) => {
            for (a, b) in read.iter().zip(&bytes) {
                assert!(a.abs_diff(*b) <= u8::from(*b == 127), "{a} {b}");
            }
        }
        Pixels::F32(_) => panic!("8-bit data stay 8-bit"),
    }
    let linear = Image::read(&path).unwrap().rgb().unwrap();
    assert!((linear[2].g - 0.2140411).abs() < 2e-3);
}

#[test]
fn float_formats_keep_the_picture_within_their_precision() {
    let folder = Folder::new("floats");
    let rgb = picture(20, 11);
    for (name, tolerance) in [("a.pfm", 0.0), ("a.exr", 0.0), ("a.hdr", 1.0 / 128.0)] {
        let path = folder.file(name);
        Image::from_rgb(20, 11, &rgb).write(&path).unwrap();
        let back = Image::read(&path).unwrap();
        assert_eq!((back.width, back.height), (20, 11));
        for (a, b) in back.rgb().unwrap().iter().zip(&rgb) {
            let bound = tolerance * b.max_component();
            for c in 0..3 {
                assert!((a[c] - b[c]).abs() <= bound, "{name}: {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn pfm_is_read_in_both_byte_orders_and_both_kinds() {
    let folder = Folder::new("pfm");
    let path = folder.file("a.pfm");
    let mut big = b"PF\n2 1\n1.0\n".to_vec();
    let mut little = b"Pf\n1 2\n-1.0\n".to_vec();
    [1.0f32, 2.0, 3.0, 4.0, 5.0, 6.0]
        .iter()
        .for_each(|v| big.extend(v.to_be_bytes()));
    [7.0f32, 8.0]
        .iter()
        .for_each(|v| little.extend(v.to_le_bytes()));
    fs::write(&path, &big).unwrap();
    let rgb = Image::read(&path).unwrap().rgb().unwrap();
    assert_eq!(rgb, [Rgb::new(1.0, 2.0, 3.0), Rgb::new(4.0, 5.0, 6.0)]);
    fs::write(&path, &little).unwrap();
    // Rows come from the bottom.
    let grey = Bitmap::read(&path).unwrap();
    assert_eq!(
        (grey.channels, grey.pixels),
        (1, Pixels::F32(vec![8.0, 7.0]))
    );
}

fn message(result: Result<impl Sized, ImageError>) -> String {
    result.err().map(|e| e.to_string()).unwrap_or_default()
}

#[test]
fn failed_writes_leave_the_old_file_and_nothing_else() {
    let folder = Folder::new("atomic");
    let image = layered();
    let missing = folder.file("none").join("a.exr");
    let expected = format!("cannot write {}: no such file or folder", missing.display());
    assert_eq!(message(image.write(&missing)), expected);

    let path = folder.file("a.exr");
    fs::write(&path, "old").unwrap();
    let mut protected = fs::metadata(&path).unwrap().permissions();
    protected.set_readonly(true);
    fs::set_permissions(&path, protected).unwrap();
    let expected = format!(
        "cannot write {}: the file is marked read-only",
        path.display()
    );
    assert_eq!(message(image.write(&path)), expected);
    assert_eq!(fs::read(&path).unwrap(), b"old");

    let inside_file = path.join("b.png");
    let expected = format!(
        "cannot write {}: a part of the path is not a folder",
        inside_file.display()
    );
    assert_eq!(message(image.write(&inside_file)), expected);
    let expected = format!(
        "cannot write {}: it is a folder",
        folder.file("d.png").display()
    );
    fs::create_dir(folder.file("d.png")).unwrap();
    assert_eq!(message(image.write(folder.file("d.png"))), expected);
    fs::remove_dir(folder.file("d.png")).unwrap();
    assert_eq!(folder.names(), ["a.exr"], "no temporary file stays behind");
}

#[test]
fn images_that_no_file_can_hold_are_refused_before_writing() {
    let folder = Folder::new("refused");
    let mut short = layered();
    short
        .layers
        .push(Layer::from_scalar("depth", Samples::Float(vec![0.0; 3])));
    let told = message(short.write(folder.file("a.exr")));
    assert!(
        told.ends_with("channel \"Y\" of layer \"depth\" has 3 samples, not 13 x 7"),
        "{told}"
    );
    let told = message(layered().write(folder.file("a.tiff")));
    assert!(
        told.ends_with("the extension is not .exr, .png, .jpg, .hdr or .pfm"),
        "{told}"
    );
    let told = message(Image::new(0, 5).write(folder.file("a.png")));
    assert!(
        told.ends_with("the picture is empty (0 x 5 pixels)"),
        "{told}"
    );
    assert!(folder.names().is_empty());
}

#[cfg(unix)]
#[test]
fn links_and_devices_are_written_through() {
    let folder = Folder::new("links");
    let image = layered();
    fs::write(folder.file("real.png"), "old").unwrap();
    std::os::unix::fs::symlink("real.png", folder.file("link.png")).unwrap();
    image.write(folder.file("link.png")).unwrap();
    let link = fs::symlink_metadata(folder.file("link.png")).unwrap();
    assert!(link.is_symlink());
    assert!(Bitmap::read(folder.file("real.png")).is_ok());
    luxel::image_io::write_atomic(Path::new("/dev/null"), b"gone").unwrap();
    assert!(!fs::metadata("/dev/null").unwrap().is_file());
}

/// Small files of every kind, by name.
fn samples(folder: &Folder) -> Vec<PathBuf> {
    let small = Image::from_rgb(5, 4, &picture(5, 4));
    let mut zipped = layered();
    zipped
        .layers
        .retain(|l| l.name == "normal" || l.name == "spp");
    let mut paths = Vec::new();
    for name in ["a.exr", "a.png", "a.jpg", "a.hdr", "a.pfm"] {
        paths.push(folder.file(name));
        small.write(folder.file(name)).unwrap();
    }
    paths.push(folder.file("layers.exr"));
    zipped.write(folder.file("layers.exr")).unwrap();
    let rgb8 = image::RgbImage::from_fn(6, 5, |x, y| image::Rgb([40 * x as u8, 50 * y as u8, 7]));
    for name in ["b.bmp", "b.tga"] {
        paths.push(folder.file(name));
        rgb8.save(folder.file(name)).unwrap();
    }
    paths
}

/// Every file cut at every length is an error; with every byte changed in turn it is an error or some
/// other picture. Never a panic.
#[test]
fn damaged_files_are_errors() {
    let folder = Folder::new("damaged");
    for path in samples(&folder) {
        let whole = fs::read(&path).unwrap();
        assert!(Image::read(&path).is_ok(), "{path:?}");
        for cut in 0..whole.len() {
            fs::write(&path, &whole[..cut]).unwrap();
            let told = message(Image::read(&path));
            let kind = path.extension().unwrap_or_default();
            // A TGA ends in a footer that its readers do not need.
            let pixels_done = kind == "tga" && cut + 26 >= whole.len();
            assert!(
                !told.is_empty() || pixels_done,
                "{path:?} cut at {cut} of {}",
                whole.len()
            );
            assert!(!told.contains("gave up"), "{path:?} cut at {cut}: {told}");
        }
        for at in 0..whole.len() {
            for flip in [0xff, 0x80, 0x01] {
                let mut bytes = whole.clone();
                bytes[at] ^= flip;
                fs::write(&path, &bytes).unwrap();
                let told = message(Image::read(&path));
                assert!(!told.contains("gave up"), "{path:?} byte {at}: {told}");
            }
        }
    }
}

#[test]
fn stored_kinds_of_pixels_are_kept() {
    let folder = Folder::new("kinds");
    let path = folder.file("a.png");
    image::ImageBuffer::from_pixel(2, 1, image::LumaA([65535u16, 32768]))
        .save(&path)
        .unwrap();
    let deep = Bitmap::read(&path).unwrap();
    assert_eq!((deep.channels, deep.encoding), (2, Encoding::Srgb));
    let half = 32768.0 / 65535.0;
    assert_eq!(deep.pixels, Pixels::F32(vec![1.0, half, 1.0, half]));
    // Alpha is a share, not a colour: the sRGB curve leaves it alone.
    assert_eq!(
        Image::read(&path).unwrap().channel("A").unwrap().get(0),
        half
    );
    image::GrayImage::from_pixel(3, 2, image::Luma([200]))
        .save(&path)
        .unwrap();
    let grey = Bitmap::read(&path).unwrap();
    assert_eq!((grey.channels, grey.pixels), (1, Pixels::U8(vec![200; 6])));
}

/// An EXR as other programs write it: 20 x 20 pixels, three kinds of samples, and any compression.
fn foreign_exr(path: &Path, compression: exr::prelude::Compression, tiled: bool) {
    use exr::prelude::*;
    let ramp = |i: usize| i as f32 / 400.0;
    let channel = |name: &str, samples| AnyChannel::new(name, samples);
    let channels = SmallVec::from_vec(vec![
        channel("R", FlatSamples::F32((0..400).map(ramp).collect())),
        channel("G", FlatSamples::F16(vec![f16::from_f32(0.25); 400])),
        channel("B", FlatSamples::F32(vec![0.5; 400])),
        channel("id", FlatSamples::U32((0..400).collect())),
    ]);
    let encoding = exr::prelude::Encoding {
        compression,
        blocks: match tiled {
            true => Blocks::Tiles(Vec2(8, 8)),
            false => Blocks::ScanLines,
        },
        line_order: LineOrder::Increasing,
    };
    exr::prelude::Image::from_encoded_channels((20, 20), encoding, AnyChannels::sort(channels))
        .write()
        .to_file(path)
        .unwrap();
}

#[test]
fn exr_of_every_compression_is_read() {
    use exr::prelude::Compression::*;
    let folder = Folder::new("compressions");
    let path = folder.file("a.exr");
    // B44, PXR24 and DWA lose precision.
    let kinds = [
        (RLE, 0.0),
        (ZIP1, 0.0),
        (ZIP16, 0.0),
        (PIZ, 0.0),
        (PXR24, 1e-4),
        (B44, 1e-4),
        (DWAA(None), 0.05),
        (DWAB(None), 0.05),
    ];
    for (compression, tolerance) in kinds {
        for tiled in [false, true] {
            foreign_exr(&path, compression, tiled);
            let image = Image::read(&path).unwrap();
            for (i, pixel) in image.rgb().unwrap().iter().enumerate() {
                let expected = [i as f32 / 400.0, 0.25, 0.5];
                for (a, b) in pixel.to_array().iter().zip(expected) {
                    assert!((a - b).abs() <= tolerance, "{compression:?}: {a} {b}");
                }
            }
            assert!(matches!(image.channel("id"), Some(Samples::Uint(v)) if v[399] == 399));
        }
    }
}

/// The decoder would ask for this much memory, and a refusal ends the process.
#[test]
fn sizes_inside_chunks_are_checked_too() {
    let folder = Folder::new("dwa");
    let path = folder.file("a.exr");
    foreign_exr(&path, exr::prelude::Compression::DWAA(None), false);
    let whole = fs::read(&path).unwrap();
    // The one chunk ends the file: row, length, and eleven numbers of 8 bytes, the first of them 2.
    let chunk = |at: &usize| {
        let rest = (whole.len() - at) as u32;
        whole[at - 4..*at] == rest.to_le_bytes() && whole[*at] == 2
    };
    let at = (4..whole.len()).find(chunk).unwrap();
    for number in [1, 6, 7, 8, 9] {
        let mut bytes = whole.clone();
        bytes[at + 8 * number + 6] = 1;
        fs::write(&path, &bytes).unwrap();
        let told = message(Image::read(&path));
        assert!(
            told.ends_with("a chunk claims more data than it has pixels"),
            "{told}"
        );
    }
}

#[test]
fn parts_with_other_windows_are_seen_from_the_first() {
    use exr::prelude::*;
    let folder = Folder::new("windows");
    let path = folder.file("a.exr");
    let part = |name: &str, at: (i32, i32), size: (usize, usize), value: f32| {
        let samples = FlatSamples::F32(vec![value; size.0 * size.1]);
        let channels = AnyChannels::sort(SmallVec::from_vec(vec![AnyChannel::new("Y", samples)]));
        let mut attributes = LayerAttributes::named(name);
        attributes.layer_position = Vec2(at.0, at.1);
        exr::prelude::Layer::new(
            size,
            attributes,
            exr::prelude::Encoding::FAST_LOSSLESS,
            channels,
        )
    };
    let parts = vec![
        part("beauty", (-1, 2), (3, 2), 1.0),
        part("mask", (0, 3), (9, 9), 2.0),
    ];
    let frame = IntegerBounds::new((-4, -4), (20, 20));
    exr::prelude::Image::from_layers(ImageAttributes::new(frame), parts)
        .write()
        .to_file(&path)
        .unwrap();
    let image = luxel::image_io::Image::read(&path).unwrap();
    assert_eq!((image.width, image.height), (3, 2));
    assert_eq!((image.offset, image.frame), ([3, 6], [20, 20]));
    assert_eq!(image.channel("Y"), Some(&Samples::Float(vec![1.0; 6])));
    let mask = vec![0.0, 0.0, 0.0, 0.0, 2.0, 2.0];
    assert_eq!(image.channel("mask.Y"), Some(&Samples::Float(mask)));
}

#[test]
fn declared_sizes_are_checked_before_memory_is_taken() {
    let folder = Folder::new("huge");
    let path = folder.file("a.pfm");
    fs::write(&path, "PF\n4000000000 4000000000\n-1.0\n").unwrap();
    let told = message(Image::read(&path));
    assert!(told.contains("pixels are more than the"), "{told}");

    let path = folder.file("a.exr");
    Image::from_rgb(5, 4, &picture(5, 4)).write(&path).unwrap();
    let mut bytes = fs::read(&path).unwrap();
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
    bytes[at + 8..at + 12].copy_from_slice(&99_999i32.to_le_bytes());
    bytes[at + 12..at + 16].copy_from_slice(&99_999i32.to_le_bytes());
    fs::write(&path, &bytes).unwrap();
    let told = message(Image::read(&path));
    assert!(
        told.contains("100000 x 100000 pixels are more than the"),
        "{told}"
    );
}

//! `luxel render --preview`, against a listener that reads the protocol of the viewer tev as tev does: each packet
//! its length in bytes with these four, then its kind and what belongs to that; numbers little-endian, names ended by
//! NUL.

use std::fs;
use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use luxel::image_io::Image;

const CREATE: u8 = 4;
const UPDATE_V3: u8 = 6;

/// A folder of its own that goes away with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let name = format!("luxel-preview-{name}-{}", std::process::id());
        let path = std::env::temp_dir().join(name);
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        fs::write(path.join("ball.xml"), BALL).unwrap();
        Folder(path)
    }

    fn render(&self, args: &str) -> Output {
        luxel(&self.0, &format!("render ball.xml --progress never {args}"))
    }

    /// The pixels of a PFM file, which are 32-bit floats as in the protocol.
    fn pixels(&self, name: &str) -> Vec<u32> {
        let colors = Image::read(self.0.join(name)).unwrap().rgb().unwrap();
        colors
            .iter()
            .flat_map(|c| c.to_array().map(f32::to_bits))
            .collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn luxel(folder: &Path, args: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_luxel"))
        .current_dir(folder)
        .args(args.split(' '))
        .output()
        .unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

const BALL: &str = r#"<scene version="3.0.0">
    <sensor type="perspective">
        <film type="hdrfilm"><integer name="width" value="60"/><integer name="height" value="40"/></film>
        <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
    </sensor>
    <integrator type="path"/>
    <shape type="sphere"><point name="center" x="0" y="0" z="5"/></shape>
    <emitter type="constant"/>
</scene>"#;

/// A port that is free, and a viewer that listens there and does `work` with who comes first.
fn viewer<T: Send + 'static>(
    work: impl FnOnce(TcpStream) -> T + Send + 'static,
) -> (u16, JoinHandle<T>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    (
        port,
        std::thread::spawn(move || work(listener.accept().unwrap().0)),
    )
}

struct Packet {
    bytes: Vec<u8>,
    at: usize,
}

impl Packet {
    /// `None` at the end of the stream, which must not be within a packet.
    fn read(stream: &mut impl Read) -> Option<Packet> {
        let mut length = [0; 4];
        if stream.read(&mut length[..1]).unwrap() == 0 {
            return None;
        }
        stream.read_exact(&mut length[1..]).unwrap();
        let mut bytes = vec![0; u32::from_le_bytes(length) as usize - 4];
        stream.read_exact(&mut bytes).unwrap();
        Some(Packet { bytes, at: 0 })
    }

    fn take<const N: usize>(&mut self) -> [u8; N] {
        self.at += N;
        self.bytes[self.at - N..self.at].try_into().unwrap()
    }

    fn flag(&mut self) -> bool {
        self.take::<1>()[0] != 0
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn u64(&mut self) -> usize {
        u64::from_le_bytes(self.take()).try_into().unwrap()
    }

    fn name(&mut self) -> String {
        let end = self.bytes[self.at..].iter().position(|b| *b == 0).unwrap();
        let name = String::from_utf8(self.bytes[self.at..self.at + end].to_vec()).unwrap();
        self.at += end + 1;
        name
    }

    fn rest(&self) -> usize {
        self.bytes.len() - self.at
    }
}

/// What a viewer knows about the one picture that it was told to show.
#[derive(Default)]
struct Shown {
    name: String,
    size: [usize; 2],
    /// R, G, B of each pixel, row by row.
    pixels: Vec<u32>,
    /// When each packet of pixels came.
    updates: Vec<Instant>,
}

impl Shown {
    fn read_all(mut stream: TcpStream) -> Shown {
        let mut shown = Shown::default();
        while let Some(packet) = Packet::read(&mut stream) {
            shown.take(packet);
        }
        shown
    }

    fn take(&mut self, mut packet: Packet) {
        let [kind] = packet.take();
        let grabs_focus = packet.flag();
        let name = packet.name();
        match kind {
            CREATE => {
                assert!(self.name.is_empty(), "created twice");
                assert!(grabs_focus);
                self.name = name;
                self.size = [packet.u32() as usize, packet.u32() as usize];
                self.pixels = vec![f32::NAN.to_bits(); 3 * self.size[0] * self.size[1]];
                assert_eq!(packet.u32(), 3);
                assert_eq!([(); 3].map(|()| packet.name()), ["R", "G", "B"]);
            }
            UPDATE_V3 => {
                assert!(!grabs_focus);
                assert_eq!(name, self.name);
                assert_eq!(packet.u32(), 3);
                assert_eq!([(); 3].map(|()| packet.name()), ["R", "G", "B"]);
                let [x, y, width, height] = [(); 4].map(|()| packet.u32() as usize);
                assert!(x + width <= self.size[0] && y + height <= self.size[1]);
                let offsets = [(); 3].map(|()| packet.u64());
                let strides = [(); 3].map(|()| packet.u64());
                let data: Vec<u32> = (0..packet.rest() / 4).map(|_| packet.u32()).collect();
                for i in 0..width * height {
                    let to = (y + i / width) * self.size[0] + x + i % width;
                    for c in 0..3 {
                        self.pixels[3 * to + c] = data[offsets[c] + i * strides[c]];
                    }
                }
                self.updates.push(Instant::now());
            }
            other => panic!("packet of kind {other}"),
        }
        assert_eq!(packet.rest(), 0);
    }
}

#[test]
fn the_viewer_ends_with_the_picture_that_is_written() {
    let folder = Folder::new("whole");
    let (port, viewer) = viewer(Shown::read_all);
    let output = folder.render(&format!(
        "--time 1300ms --threads 1 -o a.pfm --preview 127.0.0.1:{port}"
    ));
    assert!(output.status.success(), "{}", stderr(&output));
    let shown = viewer.join().unwrap();
    assert_eq!((shown.name.as_str(), shown.size), ("ball", [60, 40]));
    assert!(shown.pixels == folder.pixels("a.pfm"));
    // One at once, the last, and between them one each half second; late ones may come close to the next.
    let n = shown.updates.len();
    assert!((2..=5).contains(&n), "{n} updates");
    assert!(!stderr(&output).contains("warning"), "{}", stderr(&output));
}

#[test]
fn a_crop_is_shown_as_it_is_written() {
    let folder = Folder::new("crop");
    let (port, viewer) = viewer(Shown::read_all);
    let output = folder.render(&format!(
        "--crop 20,10,7,5 -o a.pfm --preview localhost:{port}"
    ));
    assert!(output.status.success(), "{}", stderr(&output));
    let shown = viewer.join().unwrap();
    assert_eq!(shown.size, [7, 5]);
    assert!(shown.pixels == folder.pixels("a.pfm"));
}

#[test]
fn a_large_picture_comes_in_parts() {
    let folder = Folder::new("large");
    let (port, viewer) = viewer(Shown::read_all);
    let output = folder.render(&format!(
        "--resolution 1300x1000 --spp 1 -o a.pfm --preview 127.0.0.1:{port}"
    ));
    assert!(output.status.success(), "{}", stderr(&output));
    let shown = viewer.join().unwrap();
    assert!(shown.pixels == folder.pixels("a.pfm"));
    // A packet has 2^20 pixels at most.
    assert!(shown.updates.len() >= 4, "{} packets", shown.updates.len());
}

#[test]
fn a_viewer_that_goes_changes_nothing_but_for_one_warning() {
    let folder = Folder::new("gone");
    // So many that the viewer is gone long before the last picture.
    let spp = 1024;
    let (port, viewer) = viewer(|mut stream| drop(Packet::read(&mut stream)));
    let output = folder.render(&format!("--spp {spp} -o a.pfm --preview 127.0.0.1:{port}"));
    viewer.join().unwrap();
    let said = stderr(&output);
    assert!(output.status.success(), "{said}");
    assert_eq!(said.matches("warning").count(), 1, "{said}");
    let warning = format!("warning: the viewer at 127.0.0.1:{port} is gone (");
    assert!(said.contains(&warning), "{said}");
    let alone = folder.render(&format!("--spp {spp} -o b.pfm"));
    assert!(alone.status.success());
    assert!(folder.pixels("a.pfm") == folder.pixels("b.pfm"));
}

#[test]
fn a_viewer_that_does_not_read_is_not_waited_for_long() {
    let folder = Folder::new("stuck");
    // It keeps the connection, and what does not fit into the system's buffers stays unsent.
    let (port, viewer) = viewer(|stream| stream);
    let start = Instant::now();
    let output = folder.render(&format!(
        "--resolution 1300x1000 --spp 1 -o a.pfm --preview 127.0.0.1:{port}"
    ));
    let took = start.elapsed();
    drop(viewer.join().unwrap());
    let said = stderr(&output);
    assert!(output.status.success(), "{said}");
    assert!(folder.0.join("a.pfm").exists());
    assert!(
        said.contains("has not taken the last picture within 5 s"),
        "{said}"
    );
    // 5 s of waiting; the rest is rendering on a busy machine.
    assert!(took < Duration::from_secs(60), "{took:?}");
}

#[test]
fn nobody_there_is_an_error_before_rendering() {
    let folder = Folder::new("nobody");
    // Free, since it was just given back.
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    drop(listener);
    let output = folder.render(&format!("-o a.pfm --preview 127.0.0.1:{port}"));
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.starts_with(&format!(
            "error: --preview 127.0.0.1:{port}: no viewer answers ("
        )) && said.contains("start tev before luxel"),
        "{said}"
    );
    assert!(!folder.0.join("a.pfm").exists());
}

#[test]
fn what_is_no_address_is_an_error() {
    let folder = Folder::new("address");
    for wrong in [
        "localhost",
        "localhost:",
        ":14158",
        "localhost:0",
        "localhost:70000",
        "::1:14158",
        "[]:14158",
    ] {
        let output = folder.render(&format!("--preview {wrong}"));
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{wrong}: {said}");
        assert!(said.contains("expected HOST:PORT"), "{wrong}: {said}");
    }
}

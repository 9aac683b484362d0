//! The picture so far, sent to the viewer tev (<https://github.com/Tom94/tev>) while it is rendered.
//!
//! A thread of its own talks to the viewer, and a single buffer of pixels goes to and fro between that thread and
//! the rendering: a pass that ends while the buffer is still on its way is not shown. So a slow viewer sees fewer
//! pictures and a vanished one none, and neither is ever waited for before the picture is written.

use std::io;
use std::net::{Shutdown, TcpStream, ToSocketAddrs};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

use super::Failure;
use crate::film::{Film, Window};

/// Least time between two pictures.
const EVERY: Duration = Duration::from_millis(500);
/// Taking the picture from the film holds up the rendering: at most one part in this many of its time.
const SHARE: u32 = 20;
/// How long to try each address of the viewer's host.
const CONNECT: Duration = Duration::from_secs(3);
/// How long the viewer may take for what is left when the rendering is done.
const LAST: Duration = Duration::from_secs(5);
/// Pixels of one packet, but for a single row that has more: a packet tells its length in 32 bits, and is copied
/// before it is sent.
const PACKET_PIXELS: usize = 1 << 20;

const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// Takes `HOST:PORT`, the host a name or an address (`[::1]` if it has colons itself).
pub fn parse_address(text: &str) -> Result<String, String> {
    let fits = |(host, port): (&str, &str)| {
        let bare = host.strip_prefix('[').and_then(|h| h.strip_suffix(']'));
        let host_fits = bare.map_or(!host.is_empty() && !host.contains(':'), |h| !h.is_empty());
        host_fits && port.parse::<u16>().is_ok_and(|p| p > 0)
    };
    match text.rsplit_once(':').is_some_and(fits) {
        true => Ok(text.to_string()),
        false => Err("expected HOST:PORT such as 127.0.0.1:14158, where tev listens".to_string()),
    }
}

/// A viewer that answered, and shows nothing yet.
pub struct Viewer {
    address: String,
    stream: TcpStream,
}

impl Viewer {
    /// # Errors
    /// Nobody listens at `address`.
    pub fn connect(address: &str) -> Result<Viewer, Failure> {
        let stream = connect(address).map_err(|e| {
            Failure::Usage(format!(
                "--preview {address}: no viewer answers ({e})\n  help: start tev before luxel, with --hostname \
                 {address} if that is not its 127.0.0.1:14158, or leave --preview out"
            ))
        })?;
        let address = address.to_string();
        Ok(Viewer { address, stream })
    }

    /// Opens a picture as large as `window` and called `name`, in place of any of that name.
    ///
    /// # Errors
    /// The system gives no thread.
    pub fn open(self, name: &str, window: Window) -> Result<Preview, Failure> {
        let Viewer { address, stream } = self;
        let failed = |e: io::Error| Failure::Usage(format!("--preview {address}: {e}"));
        let client = TevClient::wrap(stream.try_clone().map_err(failed)?);
        let (pictures, to_show) = channel();
        let (give_back, shown) = channel();
        // The protocol ends names by NUL.
        let name = name.replace('\0', "");
        std::thread::Builder::new()
            .name("preview".to_string())
            .spawn(move || serve(client, &name, window, &to_show, &give_back))
            .map_err(failed)?;
        Ok(Preview {
            link: Some(Link {
                stream,
                pictures,
                shown,
            }),
            address,
            due: Instant::now(),
        })
    }
}

fn connect(address: &str) -> io::Result<TcpStream> {
    let mut error = io::Error::new(io::ErrorKind::NotFound, "the host has no address");
    for at in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&at, CONNECT) {
            Ok(stream) => return Ok(stream),
            Err(e) => error = e,
        }
    }
    Err(error)
}

/// A picture that a viewer shows, for as long as the viewer is there.
pub struct Preview {
    address: String,
    /// `None` once the viewer is gone.
    link: Option<Link>,
    /// When the next picture may be sent.
    due: Instant,
}

/// The ends of the thread that talks to the viewer.
struct Link {
    stream: TcpStream,
    pictures: Sender<Vec<f32>>,
    /// The buffer, when the viewer has taken what was in it, or why it will not.
    shown: Receiver<io::Result<Vec<f32>>>,
}

impl Preview {
    /// Shows the film, if it is time to and the viewer has taken the last picture. Never waits. Gives a warning
    /// when the viewer is found gone, and then does nothing any more.
    pub fn update(&mut self, film: &Film) -> Option<String> {
        let start = Instant::now();
        if film.spp() == 0 || start < self.due {
            return None;
        }
        let sent = self.send(film, start);
        self.due = start + EVERY.max(SHARE * start.elapsed());
        self.check(sent)
    }

    /// Shows the finished film and waits until the viewer has taken it, 5 s at most. Gives a warning if it has not.
    pub fn finish(mut self, film: &Film) -> Option<String> {
        let deadline = Instant::now() + LAST;
        let sent = self.send(film, deadline).and_then(|()| match &self.link {
            Some(link) => link.buffer(deadline).map(drop),
            None => Ok(()),
        });
        if sent.is_err()
            && let Some(link) = &self.link
        {
            // Ends what the thread may be waiting for.
            let _ = link.stream.shutdown(Shutdown::Both);
        }
        match sent {
            Err(Lost::Busy) => Some(format!(
                "the viewer at {} has not taken the last picture within {} s",
                self.address,
                LAST.as_secs()
            )),
            sent => self.check(sent),
        }
    }

    fn send(&self, film: &Film, deadline: Instant) -> Result<(), Lost> {
        let Some(link) = &self.link else {
            return Ok(());
        };
        let mut buffer = link.buffer(deadline)?;
        buffer.clear();
        buffer.extend(film.mean().iter().flatten().map(|v| *v as f32));
        link.pictures.send(buffer).map_err(|_| Lost::unknown())
    }

    fn check(&mut self, sent: Result<(), Lost>) -> Option<String> {
        match sent {
            Ok(()) | Err(Lost::Busy) => None,
            Err(Lost::Gone(why)) => {
                self.link = None;
                let at = &self.address;
                Some(format!(
                    "the viewer at {at} is gone ({why}); the picture is not shown any more"
                ))
            }
        }
    }
}

/// Why a picture could not be sent.
enum Lost {
    /// The viewer has not taken the last one yet.
    Busy,
    Gone(io::Error),
}

impl Lost {
    /// The thread ended without a word.
    fn unknown() -> Lost {
        Lost::Gone(io::ErrorKind::BrokenPipe.into())
    }
}

impl Link {
    /// Takes the buffer back, when it is there before `deadline`.
    fn buffer(&self, deadline: Instant) -> Result<Vec<f32>, Lost> {
        let left = deadline.saturating_duration_since(Instant::now());
        match self.shown.recv_timeout(left) {
            Ok(shown) => shown.map_err(Lost::Gone),
            Err(RecvTimeoutError::Timeout) => Err(Lost::Busy),
            Err(RecvTimeoutError::Disconnected) => Err(Lost::unknown()),
        }
    }
}

/// Creates the picture, then sends what comes from `pictures` until that ends or the viewer does. The buffer is
/// given back each time, the first of them empty.
fn serve(
    mut client: TevClient,
    name: &str,
    window: Window,
    pictures: &Receiver<Vec<f32>>,
    give_back: &Sender<io::Result<Vec<f32>>>,
) {
    let created = client.send(PacketCreateImage {
        image_name: name,
        grab_focus: true,
        width: window.width,
        height: window.height,
        channel_names: &CHANNELS,
    });
    let mut going = created.is_ok() && give_back.send(Ok(Vec::new())).is_ok();
    if let Err(e) = created {
        let _ = give_back.send(Err(e));
    }
    while going && let Ok(picture) = pictures.recv() {
        let sent = update(&mut client, name, window, &picture);
        going = sent.is_ok();
        going &= give_back.send(sent.map(|()| picture)).is_ok();
    }
}

/// Sends all pixels, in packets of whole rows.
fn update(client: &mut TevClient, name: &str, window: Window, picture: &[f32]) -> io::Result<()> {
    let row = CHANNELS.len() * window.width as usize;
    let rows = (PACKET_PIXELS / (window.width as usize).max(1)).max(1);
    let mut y = 0;
    for data in picture.chunks((rows * row).max(1)) {
        let height = (data.len() / row) as u32;
        client.send(PacketUpdateImage {
            image_name: name,
            grab_focus: false,
            channel_names: &CHANNELS,
            channel_offsets: &[0, 1, 2],
            channel_strides: &[3; 3],
            x: 0,
            y,
            width: window.width,
            height,
            data,
        })?;
        y += height;
    }
    Ok(())
}

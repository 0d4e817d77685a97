//! Messages of `hapterra` from the pipe, drawn and added to the history.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write as _};
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context as _, Result, bail};
use hapterra_view_stream::{Message, VERSION, read};
use re_log_encoding::Encoder;

use crate::drawing::{Drawing, Entry};
use crate::history::{End, History};

/// A recording for rerun's own viewer, written beside the page's stream.
pub struct RrdFile(Encoder<BufWriter<File>>);

impl RrdFile {
    /// Creates the file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn create(path: &Path) -> Result<Self> {
        let named = || format!("cannot write {}", path.display());
        let file = File::create(path).with_context(named)?;
        let (version, options) = crate::history::encoding();
        let encoder = Encoder::new_eager(version, options, BufWriter::new(file));
        encoder.map(Self).with_context(named)
    }

    fn put(&mut self, entries: &[Entry]) -> Result<()> {
        for entry in entries {
            self.0.append(&entry.message).context("the .rrd file")?;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<()> {
        self.0.finish().context("the .rrd file")?;
        let mut file = self.0.into_inner().context("the .rrd file")?;
        file.flush().context("the .rrd file")
    }
}

/// End of a stream.
pub struct Ended {
    /// True if the writer ended the stream; otherwise it was killed.
    pub is_reported: bool,
    /// Error of the file for rerun's own viewer. The page continues without it.
    pub rrd: Result<()>,
}

/// Reads until the stream ends, and draws all of it. `on_scene` is called once, when the first
/// scene is complete: for a recording, at the end.
///
/// # Errors
/// A stream of another version, or data that is no stream.
pub fn draw(
    from: impl Read,
    history: &Arc<History>,
    rrd: Option<RrdFile>,
    on_scene: &mut dyn FnMut(),
) -> Result<Ended> {
    let mut from = BufReader::with_capacity(1 << 16, from);
    let mut drawing: Option<Drawing> = None;
    let (mut reported, mut is_reported, mut file) = (false, false, Ok(rrd));
    check_greeting(&mut from)?;
    while let Some(message) = read(&mut from)? {
        if message == Message::End {
            is_reported = true;
            break;
        }
        let has_samples = matches!(message, Message::Samples(_));
        if let (Message::Scene(scene), None) = (&message, &drawing) {
            history.begin(scene.is_live);
        }
        let entries = Drawing::take(&mut drawing, message)?;
        file = file.and_then(|rrd| write_rrd(rrd, &entries));
        history.put(entries)?;
        let is_live = drawing.as_ref().is_some_and(Drawing::is_live);
        if has_samples && is_live && !reported {
            reported = true;
            on_scene();
        }
    }
    if let Some(drawing) = &mut drawing {
        let remaining = drawing.finish()?;
        file = file.and_then(|rrd| write_rrd(rrd, &remaining));
        history.put(remaining)?;
    }
    let rrd = file.and_then(|rrd| rrd.map_or(Ok(()), RrdFile::finish));
    history.end(match is_reported {
        true => End::Reported,
        false => End::Lost,
    })?;
    if !reported && drawing.is_some() {
        on_scene();
    }
    Ok(Ended { is_reported, rrd })
}

fn write_rrd(mut rrd: Option<RrdFile>, entries: &[Entry]) -> Result<Option<RrdFile>> {
    if let Some(rrd) = &mut rrd {
        rrd.put(entries)?;
    }
    Ok(rrd)
}

fn check_greeting(from: &mut impl Read) -> Result<()> {
    match read(from)? {
        Some(Message::Hello(hello)) if hello.version == VERSION => Ok(()),
        Some(Message::Hello(hello)) => bail!(
            "hapterra {} speaks version {} of the viewer's stream, and this is version {VERSION}: build both from one checkout",
            hello.program,
            hello.version
        ),
        Some(_) => {
            bail!("the stream does not begin with a `Hello` message: hapterra did not write it")
        }
        None => bail!(
            "there is nothing on standard input: hapterra starts this program itself, with `hapterra run|demo|replay --view` or `hapterra view RECORDING`"
        ),
    }
}

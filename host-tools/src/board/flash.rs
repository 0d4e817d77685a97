//! Writes an image to a chip through a debug probe.

use probe_rs::Permissions;
use probe_rs::config::{Registry, RegistryError};
use probe_rs::flashing::{DownloadOptions, FlashError as WriteError, FlashProgress, ProgressEvent};
use probe_rs::probe::list::{Accessibility, Lister};
use probe_rs::probe::{DebugProbeError, DebugProbeInfo, DebugProbeSelector};

use super::boards::Board;
use super::image::Image;

/// Result of a successful write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Flashed {
    /// The probe that was used.
    pub probe: String,
    /// Bytes written and verified.
    pub bytes: usize,
}

/// Progress of writing: bytes, summed over all phases.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Bytes done.
    pub done: u64,
    /// Bytes to do.
    pub of: u64,
}

/// Error of writing an image.
#[derive(Debug, thiserror::Error)]
pub enum FlashError {
    /// probe-rs has no entry for the chip.
    #[error("probe-rs does not support the chip {0}")]
    UnknownChip(&'static str, #[source] RegistryError),
    /// The board has no chip.
    #[error("{0} is emulated: there is no chip to write to")]
    Emulated(&'static str),
    /// No probe is connected.
    #[error("no debug probe: looked for ST-LINK, CMSIS-DAP, J-Link and other probes on USB")]
    NoProbe,
    /// No probe matches the requested name.
    #[error("no debug probe is {requested}: there is {}", connected.join(", "))]
    NoSuchProbe {
        /// The requested name.
        requested: String,
        /// The names of the connected probes.
        connected: Vec<String>,
    },
    /// Several probes are connected, and none was named.
    #[error("several debug probes: {}", .0.join(", "))]
    ManyProbes(Vec<String>),
    /// The probe is connected, but this user may not open it.
    #[error("the debug probe {0} is there, but this user may not open it")]
    Forbidden(String),
    /// The requested name is not a valid probe selector.
    #[error("{0} does not name a probe")]
    Selector(String),
    /// The probe cannot be opened.
    #[error("the debug probe {name} cannot be opened")]
    Probe {
        /// The probe.
        name: String,
        /// The reason.
        #[source]
        source: DebugProbeError,
    },
    /// The chip does not respond.
    #[error("{chip} does not answer at the debug probe {name}")]
    Chip {
        /// The probe.
        name: String,
        /// The chip.
        chip: String,
        /// The reason.
        #[source]
        source: Box<probe_rs::Error>,
    },
    /// The chip refused the image.
    #[error("the image cannot be written to {chip}")]
    Write {
        /// The chip.
        chip: String,
        /// The reason.
        #[source]
        source: Box<WriteError>,
    },
}

/// Writes an image, verifies it and starts it. The chip is connected in reset, so that its pins
/// release the amplifiers.
///
/// # Errors
/// [`FlashError`].
pub fn flash(
    board: &Board,
    image: &Image,
    probe: Option<&str>,
    progress: &mut dyn FnMut(Progress),
) -> Result<Flashed, FlashError> {
    let chip = board.chip.ok_or(FlashError::Emulated(board.name))?;
    let target = Registry::from_builtin_families().get_target_by_name(chip);
    let target = target.map_err(|error| FlashError::UnknownChip(chip, error))?;
    let lister = Lister::new();
    let info = choose(&lister, probe)?;
    let name = name(&info);
    let opened = info.open().map_err(|source| FlashError::Probe {
        name: name.clone(),
        source,
    })?;
    let chip = target.name.clone();
    let unanswered = |source: probe_rs::Error| FlashError::Chip {
        name: name.clone(),
        chip: chip.clone(),
        source: Box::new(source),
    };
    let mut session = opened
        .attach_under_reset(target.clone(), Permissions::default())
        .map_err(unanswered)?;
    let refused = |source: WriteError| FlashError::Write {
        chip: chip.clone(),
        source: Box::new(source),
    };
    let mut loader = target.flash_loader();
    for part in &image.parts {
        loader
            .add_data(part.address, &part.bytes)
            .map_err(refused)?;
    }
    let mut options = DownloadOptions::default();
    options.verify = true;
    options.progress = FlashProgress::new(phases(progress));
    loader.commit(&mut session, options).map_err(refused)?;
    let started = session.core(0).and_then(|mut core| core.reset());
    started.map_err(unanswered)?;
    Ok(Flashed {
        probe: name,
        bytes: image.parts.iter().map(|part| part.bytes.len()).sum(),
    })
}

fn choose(lister: &Lister, requested: Option<&str>) -> Result<DebugProbeInfo, FlashError> {
    let selector = requested.map(|text| {
        text.parse::<DebugProbeSelector>()
            .map_err(|_| FlashError::Selector(text.to_owned()))
    });
    let selector = selector.transpose()?;
    let here = lister.list_all_with_access();
    let names = || here.iter().map(|item| name(&item.info)).collect::<Vec<_>>();
    let fits = |info: &DebugProbeInfo| selector.as_ref().is_none_or(|s| s.matches_probe(info));
    let mut chosen = here.iter().filter(|item| fits(&item.info));
    match (chosen.next(), chosen.next(), requested) {
        _ if here.is_empty() => Err(FlashError::NoProbe),
        (None, _, requested) => Err(FlashError::NoSuchProbe {
            requested: requested.unwrap_or_default().to_owned(),
            connected: names(),
        }),
        (Some(_), Some(_), _) => Err(FlashError::ManyProbes(names())),
        (Some(item), None, _) if item.accessibility == Accessibility::PermissionDenied => {
            Err(FlashError::Forbidden(name(&item.info)))
        }
        (Some(item), None, _) => Ok(item.info.clone()),
    }
}

fn name(info: &DebugProbeInfo) -> String {
    let serial = info.serial_number.as_deref();
    let serial = serial.map_or(String::new(), |serial| format!(":{serial}"));
    let (vendor, product) = (info.vendor_id, info.product_id);
    format!("{vendor:04x}:{product:04x}{serial} ({})", info.identifier)
}

/// Sums probe-rs' progress over the phases.
fn phases<'p>(progress: &'p mut dyn FnMut(Progress)) -> impl FnMut(ProgressEvent) + 'p {
    let mut at = Progress { done: 0, of: 0 };
    move |event| {
        match event {
            ProgressEvent::AddProgressBar { total, .. } => at.of += total.unwrap_or(0),
            ProgressEvent::Progress { size, .. } => at.done += size,
            _ => return,
        }
        progress(at);
    }
}

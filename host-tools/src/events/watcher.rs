//! Conversion of samples to events: detects changes.

use std::num::NonZeroU32;

use hapterra_core::guard::{Fault, Limits, Mode};
use hapterra_core::scene::TickRecord;

use super::event::{At, Event, Line, Place};
use super::server::Sender;
use crate::replay::{Mark, Record, mode_name, state_name};
use crate::terrain::Terrain;
use heightfield::ReadStatus;

/// Interval of reported positions, s of the device's time.
const PLACE_INTERVAL_S: f64 = 0.1;
/// Interval of material checks, s of the device's time.
const MATERIAL_INTERVAL_S: f64 = 0.01;
/// Maximum interval between samples for an estimate of the HIP's speed, s.
const MAX_SPEED_INTERVAL_S: f64 = 0.005;

/// Last reported state.
#[derive(Debug, Default)]
struct Reported {
    view: Option<usize>,
    contact: Option<bool>,
    limits: Option<(Limits, Mode, Option<Fault>)>,
    /// The class of the material; the outer `None` means no contact yet.
    class: Option<Option<i64>>,
    proxy_mm: Option<[f64; 3]>,
    place_due_s: f64,
    material_due_s: f64,
}

/// Converts a device's samples to events.
#[derive(Debug)]
pub struct Watcher {
    sender: Sender,
    device: usize,
    at: At,
    reported: Reported,
    /// Number of readers connected before the last event.
    readers: u64,
    /// The previous sample's record, with its placement.
    previous: Option<(usize, Record)>,
    /// The last lines about arming, and the number of readers at that time.
    arming: (Vec<String>, u64),
    /// Interval of reported samples.
    every: Option<NonZeroU32>,
    /// Samples since the last reported one.
    samples: u32,
}

impl Watcher {
    /// Creates the watcher of a device, counted from 1.
    #[must_use]
    pub fn new(sender: Sender, device: usize) -> Self {
        let at = At {
            device,
            tick: 0,
            t_s: 0.0,
        };
        Self {
            sender,
            device,
            at,
            reported: Reported::default(),
            readers: 0,
            previous: None,
            arming: (vec![], 0),
            every: None,
            samples: 0,
        }
    }

    /// Returns the same watcher, which also reports every `every`-th sample.
    #[must_use]
    pub fn with_samples(self, every: Option<NonZeroU32>) -> Self {
        Self { every, ..self }
    }

    /// Processes a sample, its row and its placement.
    pub fn on_sample(
        &mut self,
        sample: &TickRecord,
        record: &Record,
        (view, terrain): (usize, &Terrain<'_>),
    ) {
        let Some(readers) = self.sender.readers_joined() else {
            self.previous = None;
            return;
        };
        // A new reader receives the whole state.
        if readers != self.readers {
            (self.readers, self.reported) = (readers, Reported::default());
        }
        self.at = At {
            device: self.device,
            tick: sample.tick,
            t_s: record.t_s,
        };
        if self.reported.view.replace(view) != Some(view) {
            self.send(&view_of(view, terrain));
        }
        let limits = (sample.limits, sample.mode, sample.fault);
        if self.reported.limits.replace(limits) != Some(limits) {
            self.send(&limits_of(limits));
        }
        let touching = record.contact;
        let has_changed = self.reported.contact.replace(touching) != Some(touching);
        if touching {
            // The material of a contact is reported before the contact.
            self.send_material(record, terrain, has_changed);
        }
        if has_changed {
            self.send_contact(record, (view, terrain));
        } else if touching {
            self.send_place(record, terrain);
        }
        self.previous = Some((view, *record));
        if let Some(every) = self.every {
            self.send_sample(every, sample, record, view);
        }
    }

    /// Reports a mark.
    pub fn mark(&self, mark: &Mark) {
        self.send_now(&Event::Mark {
            marked_tick: mark.tick,
            marked_t_s: mark.t_s,
            host_unix_s: mark.host_unix_s,
            text: &mark.text,
        });
    }

    /// Reports new lines about arming, if any, and the open question. Later readers receive them
    /// too.
    pub fn arming(&mut self, new: Vec<String>, asks: Option<u32>) {
        let Some(readers) = self.sender.readers_joined() else {
            if !new.is_empty() {
                self.arming = (new, 0);
            }
            return;
        };
        let is_late = asks.is_some() && readers != self.arming.1;
        if !new.is_empty() {
            self.arming.0.clone_from(&new);
        } else if !is_late {
            return;
        }
        self.arming.1 = readers;
        let lines = &self.arming.0;
        self.send(&Event::Arming { lines, asks });
    }

    /// Reports an event that no sample shows, at the latest tick.
    pub fn send_now(&self, event: &Event<'_>) {
        if self.sender.readers_joined().is_some() {
            self.send(event);
        }
    }

    fn send_sample(
        &mut self,
        every: NonZeroU32,
        sample: &TickRecord,
        record: &Record,
        view: usize,
    ) {
        self.samples += 1;
        if self.samples < every.get() {
            return;
        }
        self.samples = 0;
        self.send(&Event::Sample {
            hip_mm: record.hip_mm,
            proxy_mm: record.proxy_mm,
            force_n: record.force_n,
            state: state_name(sample.state),
            mode: mode_name(sample.mode),
            view,
        });
    }

    fn send(&self, event: &Event<'_>) {
        let at = Some(self.at);
        self.sender.offer(Line { event, at }.text());
    }

    fn send_contact(&mut self, record: &Record, (view, terrain): (usize, &Terrain<'_>)) {
        let previous = self.previous.filter(|(of, _)| *of == view);
        let speed = previous.and_then(|(_, previous)| speed_into(&previous, record));
        self.mark_place_sent(record);
        self.send(&Event::Contact {
            touching: record.contact,
            speed_mm_s: speed.filter(|_| record.contact),
            force_n: record.force_n,
            place: place_of(record, terrain),
        });
    }

    fn mark_place_sent(&mut self, record: &Record) {
        self.reported.proxy_mm = Some(record.proxy_mm);
        self.reported.place_due_s = record.t_s + PLACE_INTERVAL_S;
    }

    fn send_place(&mut self, record: &Record, terrain: &Terrain<'_>) {
        let moved = self.reported.proxy_mm != Some(record.proxy_mm);
        if moved && record.t_s >= self.reported.place_due_s {
            self.mark_place_sent(record);
            self.send(&Event::Place(place_of(record, terrain)));
        }
    }

    fn send_material(&mut self, record: &Record, terrain: &Terrain<'_>, at_once: bool) {
        let Some(materials) = terrain.grid().materials() else {
            return;
        };
        if !at_once && record.t_s < self.reported.material_due_s {
            return;
        }
        let ground = ground_of(record, terrain);
        let (index, ReadStatus::Complete) = materials.index_at(terrain.grid(), ground) else {
            // The material is reported once it is known.
            return;
        };
        self.reported.material_due_s = record.t_s + MATERIAL_INTERVAL_S;
        let class = usize::from(index).checked_sub(1);
        let class = class.and_then(|at| materials.class_materials().class.get(at));
        let number = class.map(|class| class.class);
        if self.reported.class.replace(number) != Some(number) {
            self.send(&Event::Material {
                class: number,
                name: class.and_then(|class| class.name.as_deref()),
            });
        }
    }
}

fn view_of(view: usize, terrain: &Terrain<'_>) -> Event<'static> {
    let scale = terrain.scale_of_level_0();
    Event::View {
        view,
        level: terrain.level(),
        cell_mm: scale.cell_mm(),
        cell_m: terrain.grid().side_m(),
        height_mm_per_unit: scale.height_mm_per_unit(),
    }
}

fn limits_of((limits, mode, fault): (Limits, Mode, Option<Fault>)) -> Event<'static> {
    Event::Limits {
        limits: limits.iter_names().map(|(name, _)| name).collect(),
        mode: mode_name(mode),
        fault: fault.map(Fault::number),
    }
}

/// Returns the proxy's position in the file's coordinates.
fn ground_of(record: &Record, terrain: &Terrain<'_>) -> [f64; 2] {
    let cell_mm = terrain.scale_of_level_0().cell_mm();
    let [east, north, _] = record.proxy_mm;
    terrain.grid().to_ground([east / cell_mm, north / cell_mm])
}

fn place_of(record: &Record, terrain: &Terrain<'_>) -> Place {
    let (raster, ground) = (terrain.raster(), ground_of(record, terrain));
    let units = record.proxy_mm[2] / terrain.scale_of_level_0().height_mm_per_unit();
    Place {
        proxy_mm: record.proxy_mm,
        ground,
        lonlat: raster.georeference().to_lonlat(ground),
        height_m: units * raster.metres_per_vertical_unit(),
    }
}

/// Returns the speed of the HIP into the surface, mm/s, along the direction from proxy to HIP;
/// `None` if the samples are too far apart.
fn speed_into(previous: &Record, now: &Record) -> Option<f64> {
    let dt_s = now.t_s - previous.t_s;
    if !(dt_s > 0.0 && dt_s <= MAX_SPEED_INTERVAL_S) {
        return None;
    }
    let along = |axis: usize| now.hip_mm[axis] - now.proxy_mm[axis];
    let depth_mm = (0..3).map(|axis| along(axis).powi(2)).sum::<f64>().sqrt();
    if depth_mm == 0.0 {
        return None;
    }
    let moved = |axis: usize| now.hip_mm[axis] - previous.hip_mm[axis];
    let into: f64 = (0..3).map(|axis| moved(axis) * along(axis)).sum();
    Some(into / depth_mm / dt_s)
}

#[cfg(test)]
mod tests {
    use super::super::Server;
    use super::*;
    use crate::materials::{ClassMaterial, ClassMaterials, Materials};
    use crate::terrain::in_file::in_file;
    use crate::terrain::{HapticCells, HapticGrid, Scale};
    use crate::timeouts::wait_until;
    use hapterra_core::force::{Material, SurfaceParams};
    use heightfield::{GroundTransform, Raster};
    use std::io::{BufRead, BufReader};
    use std::net::TcpStream;

    #[test]
    fn material_is_reported_when_it_is_read_and_not_before() {
        let folder = tempfile::tempdir().expect("a folder");
        let raster = Raster::from_fn(600, 600, |_, _| 1.0).expect("raster");
        let classes = in_file(folder.path(), [600, 600], |_, _| 7.0);
        let metres = GroundTransform::new([0.0, 0.0], [1.0, 0.0], [0.0, 1.0]).expect("a map");
        let [raster, classes] = [raster, classes].map(|it| it.with_ground(metres, Some(32632)));
        let default = Material::of(&SurfaceParams::PREMIUM);
        let class = ClassMaterial {
            class: 7,
            name: None,
            material: default,
        };
        let class_materials = ClassMaterials {
            default,
            class: vec![class],
        };
        let materials =
            Materials::over(("t", &raster), ("c", classes), class_materials).expect("overlap");
        let grid = HapticGrid::new(&raster, HapticCells::Stored).with_materials(Some(&materials));
        let scale = Scale::new(1.0, 1.0).expect("scale");
        let terrain = Terrain::over(grid, scale, 0)
            .expect("terrain")
            .non_blocking();
        let record = Record {
            t_s: 0.0,
            hip_mm: [9.0; 3],
            contact: true,
            proxy_mm: [9.0; 3],
            force_n: [0.0; 3],
        };
        let server = Server::listen(0).expect("listens");
        let mut watcher = Watcher::new(server.sender(), 1);
        watcher.send_material(&record, &terrain, true);
        assert_eq!(
            watcher.reported.class, None,
            "neither waited nor the default"
        );
        wait_until("the class", || {
            watcher.send_material(&record, &terrain, true);
            watcher.reported.class.is_some()
        });
        assert_eq!(watcher.reported.class, Some(Some(7)));
    }

    #[test]
    fn late_reader_receives_the_open_query_once() {
        let server = Server::listen(0).expect("listens");
        let mut watcher = Watcher::new(server.sender(), 1);
        watcher.arming(vec!["press Enter".into()], Some(7));
        let reader = TcpStream::connect(server.address()).expect("connected");
        wait_until("the reader is seen", || {
            watcher.sender.readers_joined().is_some()
        });
        for asks in [Some(7), Some(7), None] {
            watcher.arming(vec![], asks);
        }
        drop(watcher);
        assert_eq!(server.end(), 0);
        let lines: Vec<_> = BufReader::new(reader).lines().map(Result::unwrap).collect();
        let [_hello, arming] = &lines[..] else {
            panic!("{lines:?}");
        };
        assert!(
            arming.contains(r#""lines":["press Enter"],"asks":7"#),
            "{arming}"
        );
    }
}

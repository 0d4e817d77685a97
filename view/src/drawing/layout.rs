//! The layout: terrain and hand on the left; map, text and plots on the right.

use anyhow::Result;
use hapterra_view_stream::Scene;
use re_log_types::{
    BlueprintActivationCommand, LogMsg, StoreId, StoreKind, TimeInt, TimePoint, Timeline,
};
use re_sdk_types::AsComponents;
use re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend,
    TimeAxis, TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint,
    VisibleTimeRanges,
};
use re_sdk_types::blueprint::components::{
    BackgroundKind, ColumnShare, ContainerKind, Corner2D, Eye3DKind, IncludedContent, PanelState,
    PlayState, RootContainer, RowShare, TimeRange as ShownTimes, VisibleTimeRange,
};
use re_sdk_types::components::Visible;
use re_sdk_types::datatypes::{self, TimeRange, TimeRangeBoundary, Uuid};

use super::ground::Ground;
use super::log::{self, APPLICATION, Entry, TIMELINE};
use super::shade::Rgb;
use super::{captions, plots};

/// Seconds that the plots show.
const PLOT_S: f64 = 6.0;
/// The sky.
const SKY: Rgb = [17, 24, 36];
/// Position of the eye relative to the hand, as shares of the visible size: south-south-west of it,
/// and above.
const EYE: [f64; 3] = [-0.5, -1.2, 0.8];

/// The same for the contact alone: from the south, a little above, in device millimetres.
const BESIDE: [f64; 3] = [-0.3, -1.0, 0.25];
const BESIDE_MM: f64 = 22.0;

/// A layout being written.
struct Layout {
    store: StoreId,
    entries: Vec<LogMsg>,
    /// Number of views and containers up to now, for their names.
    count: u8,
}

/// Returns the layout of a scene, as static entries.
pub(super) fn entries(scene: &Scene, ground: &Ground) -> Result<Vec<Entry>> {
    let store = StoreId::random(StoreKind::Blueprint, APPLICATION);
    let mut layout = Layout {
        entries: vec![log::opened(&store)],
        store,
        count: 0,
    };
    layout.write(scene, ground)?;
    let activated = LogMsg::BlueprintActivationCommand(BlueprintActivationCommand {
        blueprint_id: layout.store,
        make_active: true,
        make_default: true,
    });
    let entries = layout.entries.into_iter().chain([activated]).enumerate();
    // In this order, after the recording was opened and before anything else.
    Ok(entries
        .map(|(i, message)| Entry {
            key: Some(format!(" opened, layout {i:03}")),
            message,
        })
        .collect())
}

/// A view or a container, and its share of its parent.
struct Part {
    path: String,
    id: Uuid,
    share: f32,
}

impl Layout {
    fn write(&mut self, scene: &Scene, ground: &Ground) -> Result<()> {
        let terrain = self.terrain(ground)?;
        let map = self.view("2D", "Map", "map", 1.0, &[])?;
        let contact = self.contact(ground)?;
        let words = self.view("TextDocument", "Where", captions::WORDS, 1.7, &[])?;
        let unit = &scene.height_unit;
        let height = self.plot(&format!("Height ({unit})"), plots::HEIGHT, 1.0)?;
        let force = self.plot("Force (N)", plots::FORCE, 1.0)?;
        let depth = self.plot("Penetration (mm)", plots::PENETRATION, 1.0)?;
        let energy = self.plot("Energy (mJ)", plots::ENERGY, 1.0)?;
        let (across, down) = (ContainerKind::Horizontal, ContainerKind::Vertical);
        let places = self.container(down, 1.0, &[words, contact])?;
        let top = self.container(across, 4.0, &[map, places])?;
        let third = self.container(across, 1.0, &[depth, energy])?;
        let mut rows = vec![top, height, force, third];
        // A recording has no data of the link, and may have none of the cost.
        let mut last = Vec::new();
        if let Some(tick) = &scene.tick {
            let name = format!("Tick cost ({})", tick.unit);
            last.push(self.plot(&name, plots::TICK, 1.0)?);
        }
        if scene.is_live {
            last.push(self.plot("Link", plots::LINK, 1.0)?);
        }
        if !last.is_empty() {
            rows.push(self.container(across, 1.0, &last)?);
        }
        let rows = self.container(down, 0.42, &rows)?;
        let root = self.container(across, 1.0, &[terrain, rows])?;
        let viewport = ViewportBlueprint::new()
            .with_root_container(RootContainer(root.id))
            .with_auto_layout(false)
            .with_auto_views(false);
        self.log("viewport", &viewport)?;
        for panel in ["top_panel", "blueprint_panel", "selection_panel"] {
            self.log(panel, &PanelBlueprint::new().with_state(PanelState::Hidden))?;
        }
        let play = match scene.is_live {
            true => PlayState::Following,
            false => PlayState::Playing,
        };
        let time = TimePanelBlueprint::new()
            .with_state(PanelState::Collapsed)
            .with_timeline(TIMELINE)
            .with_play_state(play);
        self.log("time_panel", &time)
    }

    /// Adds terrain and hand, with an eye that follows the hand.
    fn terrain(&mut self, ground: &Ground) -> Result<Part> {
        let contents = ["+ /terrain/**", "+ /hand/**", "+ /frame/**"];
        let eye = (EYE, ground.near);
        self.space("Terrain and hand", ground, eye, (0.58, &contents))
    }

    /// Adds the hand alone, from beside it: proxy, HIP, ray and force, which the terrain hides.
    fn contact(&mut self, ground: &Ground) -> Result<Part> {
        let contents = ["+ /hand/**"];
        let eye = (BESIDE, BESIDE_MM * ground.per_mm);
        self.space("Contact", ground, eye, (1.0, &contents))
    }

    /// Adds a part of the scene, with an eye at a distance and in a direction.
    fn space(
        &mut self,
        name: &str,
        ground: &Ground,
        (direction, distance): ([f64; 3], f64),
        (share, contents): (f32, &[&str]),
    ) -> Result<Part> {
        let home = ground.home();
        let mut eye = home;
        for (place, share) in eye.iter_mut().zip(direction) {
            *place += (share * distance) as f32;
        }
        let eye = EyeControls3D::new()
            .with_kind(Eye3DKind::Orbital)
            .with_position(eye)
            .with_look_target(home)
            .with_eye_up([0.0, 0.0, 1.0])
            .with_speed(distance)
            .with_tracking_entity("/hand/proxy");
        let sky = Background::new(BackgroundKind::SolidColor).with_color(SKY);
        let grid = LineGrid3D::new().with_visible(Visible::from(false));
        let properties: [(&str, &dyn AsComponents); 3] = [
            ("EyeControls3D", &eye),
            ("Background", &sky),
            ("LineGrid3D", &grid),
        ];
        let part = self.view("3D", name, "/", share, &properties)?;
        self.log(
            &format!("{}/ViewContents", part.path),
            &ViewContents::new(contents.iter().copied()),
        )?;
        Ok(part)
    }

    fn plot(&mut self, name: &str, entity: &str, share: f32) -> Result<Part> {
        let range = last_seconds();
        let shown = VisibleTimeRanges::new([VisibleTimeRange(datatypes::VisibleTimeRange {
            timeline: TIMELINE.into(),
            range,
        })]);
        let axis = TimeAxis::new().with_view_range(ShownTimes(range));
        let legend = PlotLegend::new().with_corner(Corner2D::LeftTop);
        let properties: [(&str, &dyn AsComponents); 3] = [
            ("VisibleTimeRanges", &shown),
            ("TimeAxis", &axis),
            ("PlotLegend", &legend),
        ];
        self.view("TimeSeries", name, entity, share, &properties)
    }

    fn view(
        &mut self,
        class: &str,
        name: &str,
        entity: &str,
        share: f32,
        properties: &[(&str, &dyn AsComponents)],
    ) -> Result<Part> {
        let part = self.part("view", share);
        let origin = format!("/{}", entity.trim_start_matches('/'));
        let view = ViewBlueprint::new(class)
            .with_display_name(name)
            .with_space_origin(origin);
        self.log(&part.path, &view)?;
        let contents = ViewContents::new(["$origin/**"]);
        self.log(&format!("{}/ViewContents", part.path), &contents)?;
        for (property, what) in properties {
            self.log(&format!("{}/{property}", part.path), *what)?;
        }
        Ok(part)
    }

    fn container(&mut self, kind: ContainerKind, share: f32, parts: &[Part]) -> Result<Part> {
        let part = self.part("container", share);
        let contents = parts
            .iter()
            .map(|part| IncludedContent(part.path.clone().into()));
        let shares = parts.iter().map(|part| part.share);
        let container = ContainerBlueprint::new(kind).with_contents(contents);
        let container = match kind {
            ContainerKind::Horizontal => {
                container.with_col_shares(shares.map(|share| ColumnShare(share.into())))
            }
            _ => container.with_row_shares(shares.map(|share| RowShare(share.into()))),
        };
        self.log(&part.path, &container)?;
        Ok(part)
    }

    fn part(&mut self, kind: &str, share: f32) -> Part {
        self.count += 1;
        // Any bytes that differ from the others'; the same each time, so that a page that
        // reconnects finds its own.
        let mut bytes = *b"hapterra-view\0\0\0";
        if let Some(last) = bytes.last_mut() {
            *last = self.count;
        }
        // The marks of a random identifier, by RFC 9562.
        bytes[6] = (bytes[6] & 0x0f) | 0x40;
        bytes[8] = (bytes[8] & 0x3f) | 0x80;
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let groups = [
            &hex[..8],
            &hex[8..12],
            &hex[12..16],
            &hex[16..20],
            &hex[20..],
        ];
        Part {
            path: format!("/{kind}/{}", groups.join("-")),
            id: Uuid { bytes },
            share,
        }
    }

    fn log(&mut self, entity: &str, what: &dyn AsComponents) -> Result<()> {
        let at = TimePoint::default().with(Timeline::new_sequence("blueprint"), TimeInt::ZERO);
        self.entries.push(log::one(&self.store, entity, at, what)?);
        Ok(())
    }
}

/// Returns the last seconds before the shown time.
fn last_seconds() -> TimeRange {
    let relative = |s: f64| TimeRangeBoundary::CursorRelative(log::nanoseconds(s).into());
    TimeRange {
        start: relative(-PLOT_S),
        end: relative(0.0),
    }
}

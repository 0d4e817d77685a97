//! The views in which samples were felt: each sample names its own by a number.

use hapterra_core::scene::Sample;

use crate::link::Event;
use crate::place::Laid;
use crate::terrain::Terrain;

/// A view that is felt.
pub struct FeltView<'t> {
    /// Its terrain.
    pub terrain: Terrain<'t>,
    /// Place, scale and law; none for the scene that was served first.
    pub laid: Option<Laid>,
}

/// All views of a session, in their order.
pub struct FeltViews<'t> {
    views: Vec<FeltView<'t>>,
    /// Which of them a number means now. Numbers wrap, and count anew when a device does.
    of_number: [usize; 256],
}

impl<'t> FeltViews<'t> {
    /// The scene that is served first.
    #[must_use]
    pub fn new(terrain: Terrain<'t>) -> Self {
        let laid = None;
        Self {
            views: vec![FeltView { terrain, laid }],
            of_number: [0; 256],
        }
    }

    /// A view of this number is put in: samples may come in it from now on.
    pub fn put(&mut self, number: u8, terrain: Terrain<'t>, laid: Laid) {
        if let Some(index) = self.of_number.get_mut(usize::from(number)) {
            *index = self.views.len();
        }
        let laid = Some(laid);
        self.views.push(FeltView { terrain, laid });
    }

    /// Takes what the device tells.
    pub fn on_event(&mut self, event: &Event<'_>) {
        match event {
            // Nothing was felt in it.
            Event::Viewed { taken: false, .. } if self.views.len() > 1 => {
                self.views.pop();
            }
            // A device that was restarted begins with the latest, as the scene itself.
            Event::Opened { resumed: false, .. } => self.of_number[0] = self.views.len() - 1,
            _ => {}
        }
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.views.len()
    }

    /// Which of them a sample was felt in, from 0 on.
    #[must_use]
    pub fn index_of(&self, sample: &Sample) -> usize {
        let index = self.of_number.get(usize::from(sample.view));
        index.copied().unwrap_or(0).min(self.views.len() - 1)
    }

    /// One of them; the last, where there are not so many.
    #[must_use]
    pub fn get(&self, index: usize) -> &FeltView<'t> {
        &self.views[index.min(self.views.len() - 1)]
    }
}

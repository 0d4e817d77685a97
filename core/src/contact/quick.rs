//! The two cases that nearly every tick is: free as before, or sliding on over
//! gentle ground.
//!
//! Whether a tick is one of them depends on the terrain and on the hand's way
//! alone, never on what the window happens to hold: other bits come out than by
//! the general search, so another window must not choose another way.

use glam::Vec3;

use super::Pace;
use super::glide::glide;
use super::proxy::{Contact, Phase};
use super::spot::Hand;
use super::sweep::lower;
use super::work::{EVALUATION, VISIT};
use crate::grid::GridPoint;
use crate::terrain::{Box2, Window};

impl Contact {
    /// Answers, or changes nothing.
    #[inline]
    pub(super) fn goes_on<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: &GridPoint,
        pace: Pace,
    ) -> bool {
        match self.phase {
            Phase::Free => self.flies_on(window, hip),
            Phase::Following(_) => self.slides_on(window, hip, pace),
            _ => false,
        }
    }

    /// The last answer was "free".
    #[inline(never)]
    fn flies_on<const D: usize>(&mut self, window: &Window<'_, D>, hip: &GridPoint) -> bool {
        let low = lower(&self.hip, hip);
        let free = low.cell() >= window.top()
            || window.is_clear_nearby(Box2::around(self.hip.column(), hip.column()), low);
        if free {
            self.last.proxy = *hip;
            self.last.work = 0;
        }
        free
    }

    /// The proxy rests on gentle ground, and all of it is felt.
    #[inline(never)]
    fn slides_on<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: &GridPoint,
        pace: Pace,
    ) -> bool {
        let Phase::Following(track) = &mut self.phase else {
            return false;
        };
        let hand = Hand::new(*hip);
        let followed = (track.over == hip.column()).then(|| track.follow(&hand));
        let Some(stretch) = followed.flatten() else {
            return self.glides_on(window, hip, pace);
        };
        let proxy = hand.point_inside(&track.spot, stretch.z);
        self.rests_at(proxy, stretch, EVALUATION);
        true
    }

    /// The answer of a slide: all of it is felt, and nothing held it up.
    #[inline]
    fn rests_at(&mut self, proxy: GridPoint, stretch: Vec3, work: u32) {
        self.last.proxy = proxy;
        self.last.stretch = stretch;
        self.last.work = work;
        self.last.held_up_by = None;
        self.last.settled = true;
        self.answered = true;
    }

    /// As [`Self::slides_on`], where there is more to look at: on or over the
    /// borders of patches, for a deep hand, over twisted patches.
    #[inline(never)]
    fn glides_on<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: &GridPoint,
        pace: Pace,
    ) -> bool {
        let Phase::Following(track) = &mut self.phase else {
            return false;
        };
        let hand = Hand::new(*hip);
        match glide(window, &hand, track) {
            Ok(Some(rest)) => {
                let proxy = track.proxy(&hand, rest.stretch.z);
                self.rests_at(proxy, rest.stretch, EVALUATION + VISIT * rest.hops);
            }
            Err(tile) if pace == Pace::LockStep => {
                // For the general case this hand, when it comes again, is not new,
                // and what was felt before it is the last slide.
                (self.reached, self.left) = (None, None);
                self.before = self.last;
                self.last.held_up_by = Some(tile);
                self.last.settled = false;
                self.answered = false;
            }
            Err(_) | Ok(None) => return false,
        }
        true
    }
}

//! Opens a session, serves, continues over another line if one is lost, and ends.

use std::time::{Duration, Instant};

use hapterra_core::scene::Scene;
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::session::SessionEnd;

use super::session_handler::SessionHandler;
use crate::link::{Arming, Event, LinkError, LinkStats, Session, Timeouts, Transport};
use crate::terrain::Terrain;

/// Time between two checks of the clock while no message arrives.
const POLL: Duration = Duration::from_millis(50);

/// Remark for a device that has disarmed because its host was silent.
const WAS_SILENT: &str = "before this the device had received nothing from its host for too long: it faded the force out and disarmed the arm";

/// Opens a line to the device.
pub type Connect<'s, 't> = Box<dyn FnMut() -> Result<Box<dyn Transport + 't>, LinkError> + 's>;

/// Service of a terrain to a device.
pub struct Service<'s, 't> {
    /// The terrain. If an arm may be armed, its reads must not wait ([`Terrain::non_blocking`]).
    pub terrain: &'t Terrain<'t>,
    /// Placement and surface.
    pub scene: Scene,
    /// Arming.
    pub arming: Arming,
    /// Time-outs.
    pub timeouts: Timeouts,
    /// Opens a line to the device. There is only one line at a time: the one before is closed when
    /// this is called.
    pub connect: Connect<'s, 't>,
    /// The device as the user names it.
    pub device: String,
    /// Time between two tries to find a lost device.
    pub retry: Duration,
    /// Returns true while the user wants to continue.
    pub should_continue: &'t dyn Fn() -> bool,
    /// Prints the messages that must reach the user in every case.
    pub notify: &'s dyn Fn(&str),
}

/// An open session, which is closed when it is dropped, also in a panic.
pub struct ServedSession<'s, 't> {
    session: Session<'t>,
    connect: Connect<'s, 't>,
    device: String,
    retry: Duration,
    should_continue: &'t dyn Fn() -> bool,
    notify: &'s dyn Fn(&str),
    /// True if the open message was sent, or may have been.
    has_greeted: bool,
    is_closed: bool,
}

/// End of a service.
#[derive(Debug)]
pub struct End {
    /// The error that ended the service, if there was one.
    pub result: Result<(), LinkError>,
    /// The device's confirmation that it is disarmed: [`LinkError::NotConfirmed`] if it does not
    /// confirm, and [`LinkError::Taken`] if it answers that it has another host. This host must not
    /// disarm another host's arm: if [`End::result`] is [`LinkError::Taken`], this is no error.
    pub disarmed: Result<(), LinkError>,
    /// Statistics of the link.
    pub stats: LinkStats,
}

impl<'s, 't> Service<'s, 't> {
    /// Opens a line, calls `check` for the device, and opens a session.
    ///
    /// # Errors
    /// No line; the error from `check`; [`LinkError`]. Once the line is open, the device is
    /// disarmed before the error is returned, or the user gets a warning that it may still be
    /// armed.
    pub fn open<E: From<LinkError>>(
        mut self,
        check: impl FnOnce(&mut dyn Transport) -> Result<(), E>,
    ) -> Result<(ServedSession<'s, 't>, DeviceHello), E> {
        let mut line = (self.connect)()?;
        let checked = check(&mut *line);
        let (scene, arming) = (self.scene, Some(self.arming));
        let session = Session::new(self.terrain, scene, arming, line, self.timeouts);
        let mut served = ServedSession {
            session: session.continuing_while(self.should_continue),
            connect: self.connect,
            device: self.device,
            retry: self.retry,
            should_continue: self.should_continue,
            notify: self.notify,
            has_greeted: false,
            is_closed: false,
        };
        if let Err(error) = checked {
            served.close_and_report(None);
            return Err(error);
        }
        served.has_greeted = true;
        match served.session.begin(&mut |_| {}) {
            Ok(device) => Ok((served, device)),
            Err(error) => {
                served.close_and_report(Some(&error));
                Err(error.into())
            }
        }
    }
}

impl<'t> ServedSession<'_, 't> {
    /// Serves until the handler ends, the user ends, or an error occurs that waiting does not fix;
    /// then closes the session.
    pub fn serve(mut self, handler: &mut dyn SessionHandler<'t>) -> End {
        let result = self.run_until_over(handler);
        let disarmed = self.close(result.as_ref().err(), &mut |event| handler.on_event(event));
        let stats = self.session.stats().clone();
        End {
            result,
            disarmed,
            stats,
        }
    }

    fn run_until_over(&mut self, handler: &mut dyn SessionHandler<'t>) -> Result<(), LinkError> {
        while (self.should_continue)() && !handler.is_over() {
            let polled = self
                .session
                .poll(POLL, &mut |event| handler.on_event(event));
            for request in handler.requests() {
                self.session.enqueue(request);
            }
            // The next poll reports any error of the line.
            let put = handler
                .scene_change()
                .map(|(view, terrain)| self.session.put_view(view, terrain));
            let polled = polled.and(put.unwrap_or(Ok(())));
            handler.show(self.session.stats());
            match polled {
                Err(error) if error.is_transient() => self.wait_for_device(handler, &error)?,
                other => other?,
            }
        }
        Ok(())
    }

    /// Reports the disconnection, waits for the device and resumes the session.
    fn wait_for_device(
        &mut self,
        handler: &mut dyn SessionHandler<'t>,
        why: &LinkError,
    ) -> Result<(), LinkError> {
        let (why, device) = (with_cause(why), &self.device);
        handler.notify(&format!("{why}; waiting for {device} (Ctrl-C ends)"));
        let start = Instant::now();
        while (self.should_continue)() {
            // The old line may still have a claim on a silent device.
            self.session.close_line();
            match self.resume(handler) {
                Ok(device) => {
                    let again = match device.epoch == Some(self.session.scene().epoch) {
                        true => "continues where it was",
                        false => "was restarted and starts again",
                    };
                    let after = start.elapsed();
                    handler.notify(&format!("the device is back after {after:.1?}: it {again}"));
                    if let Some(line) = last_end_remark(&device) {
                        handler.notify(line);
                    }
                    return Ok(());
                }
                Err(LinkError::Interrupted) => return Ok(()),
                Err(error) if !error.is_transient() => return Err(error),
                Err(_) => std::thread::sleep(self.retry),
            }
        }
        Ok(())
    }

    fn resume(&mut self, handler: &mut dyn SessionHandler<'t>) -> Result<DeviceHello, LinkError> {
        let line = (self.connect)()?;
        let on = &mut |event: Event<'_>| handler.on_event(event);
        self.session.resume(line, self.should_continue, on)
    }

    /// Ends the session, whatever has ended the service.
    fn close(
        &mut self,
        why: Option<&LinkError>,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<(), LinkError> {
        self.is_closed = true;
        match why {
            // Another host controls the arm and reports its end itself.
            Some(LinkError::Taken) => return Ok(()),
            // The device cannot read this host's messages.
            Some(LinkError::Version { .. }) => return Err(LinkError::NotConfirmed),
            _ => {}
        }
        if !self.session.has_line()
            && let Ok(line) = (self.connect)()
        {
            self.session.switch_line(line);
        }
        match self.has_greeted {
            true => self.session.close(on),
            false => self.session.open_and_close(on),
        }
    }

    fn close_and_report(&mut self, why: Option<&LinkError>) {
        if let Err(not_confirmed) = self.close(why, &mut |_| {}) {
            (self.notify)(&not_confirmed.to_string());
        }
    }
}

impl Drop for ServedSession<'_, '_> {
    fn drop(&mut self) {
        if !self.is_closed {
            self.close_and_report(None);
        }
    }
}

/// Returns a remark if the device disarmed the last session's arm because its host was silent.
#[must_use]
pub fn last_end_remark(device: &DeviceHello) -> Option<&'static str> {
    (device.last.end == SessionEnd::HostSilent).then_some(WAS_SILENT)
}

fn with_cause(error: &LinkError) -> String {
    match error {
        LinkError::Disconnected(why) => format!("{error}: {why}"),
        _ => error.to_string(),
    }
}

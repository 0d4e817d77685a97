//! Asking a device who it is, without a scene.

use std::time::{Duration, Instant};

use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::message::{DeviceHello, HostHello, PROTOCOL, ToDevice, ToHost};

use super::{LinkError, Transport};

/// Says hello and waits for the device's. It keeps the scene that it holds.
///
/// # Errors
/// [`LinkError`]: nobody answers within `patience`, or in another protocol.
pub fn ask_who(
    transport: &mut dyn Transport,
    patience: Duration,
) -> Result<DeviceHello, LinkError> {
    let mut frame = [0; MAX_FRAME];
    let hello = ToDevice::Hello(HostHello { protocol: PROTOCOL });
    let bytes = encode(&hello, &mut frame).unwrap_or(&[]); // the longest message fits
    // A zero first ends whatever may have been under way.
    let sent = transport.send(&[0]).and_then(|()| transport.send(bytes));
    sent.map_err(LinkError::Gone)?;
    let began = Instant::now();
    let mut reader = FrameReader::<MAX_FRAME>::new();
    let mut incoming = [0; 1024];
    while began.elapsed() < patience {
        let received = transport
            .receive(&mut incoming, Duration::from_millis(50))
            .map_err(LinkError::Gone)?;
        let mut bytes = incoming.get(..received).unwrap_or(&[]);
        while !bytes.is_empty() {
            let (taken, frame) = reader.push(bytes);
            bytes = bytes.get(taken..).unwrap_or(&[]);
            match frame.map(|frame| frame.and_then(decode::<ToHost>)) {
                Some(Ok(ToHost::Hello(device))) if device.protocol == PROTOCOL => {
                    return Ok(device);
                }
                Some(Ok(ToHost::Hello(DeviceHello { protocol, .. })))
                | Some(Ok(ToHost::Refused { protocol })) => {
                    return Err(LinkError::Version {
                        ours: PROTOCOL,
                        theirs: protocol,
                    });
                }
                // Telemetry of a scene under way, or the rest of a frame.
                _ => {}
            }
        }
    }
    Err(LinkError::Silent(began.elapsed()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::Native;
    use std::io;

    #[test]
    fn a_device_says_who_it_is() {
        let mut device = Native::for_replay();
        let hello = ask_who(&mut device, Duration::from_secs(20)).expect("it answers");
        assert_eq!(hello.board.as_str(), "native");
    }

    /// Something that listens and says one thing.
    struct Says(Vec<u8>);

    impl Transport for Says {
        fn send(&mut self, _: &[u8]) -> io::Result<()> {
            Ok(())
        }

        fn receive(&mut self, into: &mut [u8], _: Duration) -> io::Result<usize> {
            let n = self.0.len().min(into.len());
            into[..n].copy_from_slice(&self.0[..n]);
            self.0.drain(..n);
            Ok(n)
        }
    }

    #[test]
    fn one_that_says_nothing_or_nonsense_or_another_protocol_is_told_apart() {
        let ask = |said: Vec<u8>| ask_who(&mut Says(said), Duration::from_millis(5));
        assert!(matches!(ask(vec![]), Err(LinkError::Silent(_))));
        let nonsense = b"HTTP/1.1 400\0\0".to_vec();
        assert!(matches!(ask(nonsense), Err(LinkError::Silent(_))));
        let mut frame = [0; MAX_FRAME];
        let refused = ToHost::Refused { protocol: 77 };
        let bytes = encode(&refused, &mut frame).expect("fits").to_vec();
        assert!(matches!(
            ask(bytes),
            Err(LinkError::Version { theirs: 77, .. })
        ));
    }
}

//! What comes back from the device.

use super::adapter::Device;
use super::buffers::Maker;
use crate::Result;
use std::time::Duration;

/// A device that takes longer than this for a frame hangs.
const LONGEST: Duration = Duration::from_secs(120);

/// A buffer that a frame's results come back in.
#[derive(Debug)]
pub(crate) struct Readback(wgpu::Buffer);

impl Readback {
    pub fn new(maker: &Maker, bytes: u64) -> Self {
        Self(maker.readback("results of a frame", bytes))
    }

    /// Copies bytes of buffers into it (buffer, first byte, how many), one after the other.
    pub fn copy(&self, encoder: &mut wgpu::CommandEncoder, buffers: &[(&wgpu::Buffer, u64, u64)]) {
        let mut at = 0;
        for (buffer, from, bytes) in buffers.iter().filter(|(_, _, bytes)| *bytes > 0) {
            encoder.copy_buffer_to_buffer(buffer, *from, &self.0, at, *bytes);
            at += bytes;
        }
    }

    /// Copies a picture into it, rows of so many bytes each.
    pub fn copy_picture(&self, encoder: &mut wgpu::CommandEncoder, picture: &wgpu::Texture, row: u32) {
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        let to = wgpu::TexelCopyBufferInfo { buffer: &self.0, layout };
        encoder.copy_texture_to_buffer(picture.as_image_copy(), to, picture.size());
    }

    /// Waits for the device, and hands over the bytes.
    pub fn wait(&self, device: &Device, take: impl FnOnce(&[u8])) -> Result<()> {
        self.ready(device)?;
        self.take(device, take)
    }

    /// Waits for the device.
    pub fn ready(&self, device: &Device) -> Result<()> {
        let (sender, receiver) = std::sync::mpsc::channel();
        self.0.map_async(wgpu::MapMode::Read, .., move |result| {
            // Nobody waits any more where the receiver is gone.
            let _ = sender.send(result);
        });
        let waited =
            device.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: Some(LONGEST) });
        device.check()?;
        waited.map_err(|e| device.fault(&e.to_string()))?;
        let mapped = receiver.recv_timeout(LONGEST).map_err(|e| device.fault(&e.to_string()))?;
        mapped.map_err(|e| device.fault(&e.to_string()))
    }

    /// Hands over the bytes of what is ready.
    pub fn take(&self, device: &Device, take: impl FnOnce(&[u8])) -> Result<()> {
        let view = self.0.get_mapped_range(..).map_err(|e| device.fault(&e.to_string()))?;
        take(&view);
        drop(view);
        self.0.unmap();
        Ok(())
    }
}

/// The floats of a whole buffer.
pub(crate) fn read(device: &Device, buffer: &wgpu::Buffer) -> Result<Vec<f32>> {
    let back = Readback::new(&Maker(device), buffer.size());
    let mut encoder = device.device.create_command_encoder(&Default::default());
    back.copy(&mut encoder, &[(buffer, 0, buffer.size())]);
    device.queue.submit([encoder.finish()]);
    let mut floats = Vec::new();
    back.wait(device, |bytes| floats.extend_from_slice(bytemuck::cast_slice(bytes)))?;
    Ok(floats)
}

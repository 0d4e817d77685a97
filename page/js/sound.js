// The force as sound: its size is the pitch, and its changes are a rustling noise.

/** Pitch without force, Hz, and its increase for each newton. */
const BASE_HZ = 85;
const PER_NEWTON_HZ = 55;

export class Sound {
  #context = null;
  #make;
  isOn = false;

  /** `make` creates the audio context. */
  constructor(make = () => new AudioContext()) {
    this.#make = make;
  }

  /** Switches the sound on or off. Called from a click, because browsers allow sound only then. */
  toggle() {
    if (!this.#context) this.#open();
    this.isOn = !this.isOn;
    this.isOn ? this.#context.resume() : this.#context.suspend();
  }

  #open() {
    const context = (this.#context = this.#make());
    const gain = () => {
      const node = new GainNode(context, { gain: 0 });
      node.connect(context.destination);
      return node;
    };
    this.tone = new OscillatorNode(context, { type: "triangle", frequency: BASE_HZ });
    this.toneGain = gain();
    this.tone.connect(this.toneGain);
    this.tone.start();
    const noise = new AudioBuffer({ length: context.sampleRate, sampleRate: context.sampleRate });
    noise.getChannelData(0).forEach((_, i, data) => (data[i] = Math.random() * 2 - 1));
    this.rustle = new AudioBufferSourceNode(context, { buffer: noise, loop: true });
    this.filter = new BiquadFilterNode(context, { type: "bandpass", frequency: 900, Q: 0.8 });
    this.rustleGain = gain();
    this.rustle.connect(this.filter).connect(this.rustleGain);
    this.rustle.start();
  }

  /** Sets a frame's force, N, and its change from tick to tick, N. */
  update(newtons, changeN) {
    if (!this.isOn) return;
    const soon = this.#context.currentTime;
    this.tone.frequency.setTargetAtTime(BASE_HZ + PER_NEWTON_HZ * newtons, soon, 0.02);
    this.toneGain.gain.setTargetAtTime(Math.min(0.16, 0.06 * newtons), soon, 0.02);
    this.rustleGain.gain.setTargetAtTime(Math.min(0.35, 6 * changeN), soon, 0.015);
  }
}

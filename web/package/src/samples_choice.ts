/** Frames that are slower than this on average cannot afford more than one sample a pixel while the camera moves. */
const kSlowFrameMilliseconds = 24;
const kFramesToJudge = 12;
/** A frame that began so long after the last one says nothing of how fast frames are. */
const kPauseMilliseconds = 500;

/** How many samples a pixel gets: all where nothing moves; while it moves only where the frames have shown that they can. */
export class SamplesChoice {
  private frames = 0;
  private milliseconds = 0;
  private isAffordable = true;
  /** As the engine was told last. */
  now = 1;

  /** Whether moving pictures get all samples, whatever was found before. */
  assume(isAffordable: boolean): void {
    this.isAffordable = isAffordable;
  }

  /** Begins again with what `wanted` asks for. */
  restart(wanted: number): void {
    this.now = this.isAffordable ? wanted : 1;
  }

  /** Returns whether `now` changed. */
  choose(wanted: number, isAtRest: boolean): boolean {
    const next = isAtRest || this.isAffordable ? wanted : 1;
    const isNew = next !== this.now;
    this.now = next;
    return isNew;
  }

  /** A frame was drawn so long after the one before. */
  judge(intervalMilliseconds: number): void {
    if (this.now === 1 || !this.isAffordable || intervalMilliseconds > kPauseMilliseconds) return;
    this.frames += 1;
    this.milliseconds += intervalMilliseconds;
    if (this.frames < kFramesToJudge) return;
    if (this.milliseconds / this.frames > kSlowFrameMilliseconds) this.isAffordable = false;
    this.frames = this.milliseconds = 0;
  }
}

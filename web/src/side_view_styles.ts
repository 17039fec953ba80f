import { css } from "lit";

export const kSideViewStyles = css`
  :host {
    display: block;
  }
  .views {
    display: flex;
    flex-wrap: wrap;
    gap: 0.5rem 1.25rem;
  }
  .bench {
    flex: 1 1 24rem;
    min-width: 0;
    overflow: hidden;
  }
  svg {
    display: block;
    max-width: 100%;
    touch-action: pan-y;
    user-select: none;
  }
  .note {
    margin: 0.2rem 0 0;
    font-size: 0.8125rem;
  }
  .note button {
    padding: 0 0.4rem;
  }
  text {
    fill: var(--muted);
    font-size: 12px;
    font-variant-numeric: tabular-nums;
  }
  text.name {
    font-size: 12.75px;
  }
  line,
  path {
    fill: none;
    stroke: var(--muted);
  }
  .axis {
    stroke-dasharray: 8 3 2 3;
    stroke: var(--line);
  }
  .scale {
    stroke: var(--control);
  }
  .sharp {
    fill: var(--sharp);
    fill-opacity: 0.22;
  }
  .ray {
    stroke: var(--ray);
    stroke-width: 1.25;
  }
  .ray.beyond {
    stroke-dasharray: 3 3;
  }
  .glass {
    fill: var(--accent);
    fill-opacity: 0.16;
    stroke: none;
  }
  .stop {
    stroke: var(--text);
    stroke-width: 3;
  }
  .sensor {
    stroke: var(--text);
    stroke-width: 2;
  }
  .blur {
    stroke: var(--ray);
    stroke-width: 5;
  }
  .plane {
    stroke: var(--sharp-line);
    stroke-width: 2;
  }
  .handle {
    cursor: ew-resize;
    outline: none;
  }
  .handle.aperture {
    cursor: ns-resize;
  }
  .handle .hit {
    fill: transparent;
    stroke: none;
    touch-action: none;
  }
  .handle .knob {
    fill: var(--panel);
    stroke: var(--text);
    stroke-width: 1.5;
  }
  .handle.focus .knob {
    fill: var(--sharp-line);
  }
  .handle.subject .knob {
    fill: var(--ray);
  }
  .handle:hover .knob,
  .handle.held .knob {
    stroke-width: 2.5;
  }
  .handle:focus-visible .hit {
    stroke: var(--accent);
    stroke-width: 2;
  }
`;

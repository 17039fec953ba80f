import { css } from "lit";

export const kStageStyles = css`
  :host {
    display: block;
  }
  .frame {
    position: relative;
    aspect-ratio: var(--ratio);
    overflow: hidden;
    border-radius: var(--radius);
    background: var(--mat);
  }
  img,
  canvas.overlay,
  canvas.difference,
  .touch,
  .mark {
    position: absolute;
    inset: 0;
    display: block;
    width: 100%;
    height: 100%;
  }
  .touch {
    cursor: crosshair;
  }
  .touch:focus-visible {
    outline-offset: -3px;
  }
  img.other {
    clip-path: inset(0 0 0 var(--wipe));
    /* In its own shape; the bars beside it hide the other picture. */
    object-fit: contain;
    background: var(--mat);
  }
  .divider {
    position: absolute;
    inset: 0 auto 0 calc(var(--wipe) - 1px);
    width: 2px;
    background: #fff;
    box-shadow: 0 0 0 1px #0008;
    pointer-events: none;
  }
  .wipe {
    position: absolute;
    inset: auto 0 0.4rem;
    width: 100%;
    height: 2rem;
    margin: 0;
    background: none;
    appearance: none;
    pointer-events: none;
  }
  .wipe::-webkit-slider-thumb {
    width: 2rem;
    height: 2rem;
    border: 2px solid #000a;
    border-radius: 50%;
    background: #fff;
    appearance: none;
    cursor: ew-resize;
    pointer-events: auto;
  }
  .wipe::-moz-range-thumb {
    width: 2rem;
    height: 2rem;
    border: 2px solid #000a;
    border-radius: 50%;
    background: #fff;
    cursor: ew-resize;
    pointer-events: auto;
  }
  .tag {
    position: absolute;
    top: 0.4rem;
    left: 0.4rem;
    padding: 0 0.45rem;
    border-radius: 3px;
    background: #000c;
    color: #fff;
    font-weight: 600;
    pointer-events: none;
  }
  .tag.right {
    right: 0.4rem;
    left: auto;
  }
  .mark {
    pointer-events: none;
  }
  .mark path {
    fill: none;
    stroke: #fff;
    stroke-width: 1;
    opacity: 0.55;
    mix-blend-mode: difference;
  }
  .mark.point path {
    stroke-dasharray: 2 6;
  }
  .mark.cross path {
    opacity: 1;
  }
  .loupe {
    position: absolute;
    width: 176px;
    height: 176px;
    border: 2px solid #fff;
    border-radius: 50%;
    box-shadow: 0 0 0 1px #0009;
    background: #000;
    pointer-events: none;
    transform: translate(14px, calc(-100% - 14px));
  }
  .loupe.low {
    transform: translate(14px, 14px);
  }
  .loupe.left {
    transform: translate(calc(-100% - 14px), calc(-100% - 14px));
  }
  .loupe.low.left {
    transform: translate(calc(-100% - 14px), 14px);
  }
  .reading {
    min-height: 1.4em;
    margin: 0.3rem 0 0;
    font-size: 0.875rem;
    color: var(--muted);
  }
  :host([outdated]) img:not(.other),
  :host([other_outdated]) img.other {
    filter: contrast(0.4);
  }
  .empty {
    position: absolute;
    inset: 0;
    display: grid;
    place-items: center;
    color: var(--muted);
  }
  .empty.why {
    padding: 1rem;
    background: var(--mat);
    text-align: center;
  }
  .busy::after {
    content: "";
    position: absolute;
    inset: auto 0 0;
    height: 3px;
    background: var(--accent);
    transform-origin: left;
    /* Its frames take processor time from the render: a short one is not swept. */
    animation: sweep 1.6s ease-in-out 0.4s infinite;
    transform: translateX(-100%);
  }
  @keyframes sweep {
    from {
      transform: translateX(-100%);
    }
    to {
      transform: translateX(100%);
    }
  }
  @media (prefers-reduced-motion: reduce) {
    .busy::after {
      animation: none;
      transform: none;
    }
  }
`;

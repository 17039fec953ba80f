import { css } from "lit";

/// Series differ by dash or shape too, not by colour alone.
export const kPlotStyles = css`
  :host {
    display: block;
    min-width: 0;
  }
  figure {
    margin: 0;
  }
  figcaption {
    font-weight: 500;
  }
  svg {
    display: block;
    max-width: 100%;
  }
  .legend {
    display: flex;
    flex-wrap: wrap;
    gap: 0.1rem 1rem;
    margin: 0.3rem 0;
    padding: 0;
    font-size: 0.8125rem;
    list-style: none;
  }
  .legend li {
    display: flex;
    align-items: center;
    gap: 0.35rem;
  }
  text {
    fill: var(--muted);
    font-size: 0.8rem;
    font-variant-numeric: tabular-nums;
  }
  text.name {
    font-size: 0.85rem;
  }
  .grid {
    stroke: var(--line);
  }
  line.mark {
    stroke: var(--muted);
    stroke-dasharray: 2 4;
  }
  text.mark {
    fill: var(--text);
    /* Keeps the grid off the letters. */
    stroke: var(--panel);
    stroke-width: 4px;
    stroke-linejoin: round;
    paint-order: stroke;
  }
  .line {
    fill: none;
    stroke: var(--series);
    stroke-width: 2;
  }
  .dots {
    fill: var(--series);
    stroke: var(--panel);
  }
  .rings {
    fill: none;
    stroke: var(--series);
    stroke-width: 2.5;
  }
  .s0 {
    --series: var(--series-0);
  }
  .s1 {
    --series: var(--series-1);
    stroke-dasharray: 7 4;
  }
  .s2 {
    --series: var(--series-2);
    stroke-dasharray: 2 3;
  }
  .s3 {
    --series: var(--series-3);
    stroke-dasharray: 9 3 2 3;
  }
  .s4 {
    --series: var(--series-4);
  }
  .s5 {
    --series: var(--series-5);
  }
  .s6 {
    --series: var(--text);
  }
  .dots,
  .rings {
    stroke-dasharray: none;
  }
  .files {
    display: flex;
    flex-wrap: wrap;
    gap: 0.5rem;
    align-items: baseline;
    margin-top: 0.3rem;
    font-size: 0.875rem;
  }
  details[open] {
    flex-basis: 100%;
  }
  summary {
    padding: 0.3rem 0;
    cursor: pointer;
  }
  .scroll {
    max-height: 18rem;
    overflow: auto;
  }
  table {
    border-collapse: collapse;
    font-variant-numeric: tabular-nums;
  }
  th,
  td {
    padding: 0.15rem 0.7rem 0.15rem 0;
    border-bottom: 1px solid var(--line);
    text-align: right;
    font-weight: 400;
  }
  th {
    color: var(--muted);
  }
`;

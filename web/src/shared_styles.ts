/// Styles that several components share.
import { css } from "lit";

export const kBaseStyles = css`
  *,
  *::before,
  *::after {
    box-sizing: border-box;
  }
  :focus-visible {
    outline: 2px solid var(--accent);
    outline-offset: 2px;
  }
  h2 {
    margin: 0 0 0.6rem;
    font-size: 0.8125rem;
    font-weight: 600;
    letter-spacing: 0.06em;
    text-transform: uppercase;
    color: var(--muted);
  }
  p {
    margin: 0 0 0.5rem;
  }
  .muted {
    color: var(--muted);
  }
  .fault {
    margin: 0.25rem 0 0;
    color: var(--fault);
    font-size: 0.875rem;
  }
  button,
  a.button {
    display: inline-block;
    padding: 0.3rem 0.7rem;
    border: 1px solid var(--control);
    border-radius: var(--radius);
    background: var(--panel);
    color: var(--text);
    font: inherit;
    text-decoration: none;
    cursor: pointer;
  }
  button:disabled {
    color: var(--muted);
    cursor: default;
  }
  button[aria-pressed="true"] {
    background: var(--accent);
    color: var(--on-accent);
  }
  [hidden] {
    display: none;
  }
  .number {
    font-variant-numeric: tabular-nums;
  }
`;

export const kControlStyles = css`
  .field,
  fieldset {
    margin: 0 0 0.95rem;
    min-width: 0;
  }
  fieldset {
    padding: 0;
    border: 0;
  }
  .caption,
  legend {
    display: flex;
    justify-content: space-between;
    gap: 0.5rem;
    width: 100%;
    margin: 0 0 0.3rem;
    padding: 0;
    font-weight: 500;
  }
  output {
    font-variant-numeric: tabular-nums;
  }
  select,
  input[type="text"] {
    width: 100%;
    min-width: 0;
    min-height: 2.25rem;
    padding: 0.3rem 0.55rem;
    border: 1px solid var(--control);
    border-radius: var(--radius);
    background: var(--panel);
    color: inherit;
    font: inherit;
  }
  input[type="text"][aria-invalid="true"],
  select[aria-invalid="true"] {
    border-color: var(--fault);
    box-shadow: inset 0 0 0 1px var(--fault);
  }
  input[type="range"] {
    width: 100%;
    height: 1.75rem;
    margin: 0;
    accent-color: var(--accent);
  }
  input[type="checkbox"] {
    width: 1.1rem;
    height: 1.1rem;
    margin: 0;
    accent-color: var(--accent);
  }
  .row {
    display: flex;
    align-items: center;
    gap: 0.75rem;
  }
  .with-unit {
    display: flex;
    align-items: center;
    gap: 0.4rem;
    flex: 1;
    min-width: 0;
  }
  .tick {
    display: inline-flex;
    align-items: center;
    gap: 0.45rem;
    min-height: 2.25rem;
    white-space: nowrap;
  }
  .segments {
    display: grid;
    grid-template-columns: repeat(var(--columns, 5), 1fr);
    gap: 1px;
    overflow: hidden;
    border: 1px solid var(--control);
    border-radius: var(--radius);
    background: var(--line);
  }
  .segments.two {
    --columns: 2;
  }
  .segments.three {
    --columns: 3;
  }
  .segments.four {
    --columns: 4;
  }
  .segments:focus-within {
    overflow: visible;
  }
  .segments label {
    position: relative;
    padding: 0.4rem 0.3rem;
    background: var(--panel);
    text-align: center;
    font-variant-numeric: tabular-nums;
    cursor: pointer;
  }
  .segments input {
    position: absolute;
    inset: 0;
    margin: 0;
    opacity: 0;
    cursor: pointer;
  }
  .segments label:has(input:checked) {
    background: var(--accent);
    color: var(--on-accent);
  }
  .segments label:has(input:focus-visible) {
    z-index: 1;
    outline: 2px solid var(--accent);
    outline-offset: 2px;
  }
`;

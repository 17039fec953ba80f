import { css } from "lit";

export const kAppStyles = css`
  :host {
    display: block;
    max-width: 150rem;
    margin: 0 auto;
    padding: 0 clamp(0.75rem, 2vw, 2rem) 2rem;
  }
  header {
    display: flex;
    flex-wrap: wrap;
    align-items: center;
    gap: 0.3rem 0.9rem;
    padding: 0.6rem 0 0.5rem;
  }
  h1 {
    margin: 0;
    font-size: 1.25rem;
    font-weight: 600;
    letter-spacing: -0.01em;
  }
  header p {
    flex: 1;
    margin: 0;
  }
  main {
    display: grid;
    grid-template-columns: minmax(0, 1fr);
    gap: var(--gap);
  }
  .panel {
    min-width: 0;
    padding: 1rem;
    border: 1px solid var(--line);
    border-radius: var(--radius);
    background: var(--panel);
  }
  .compare {
    display: flex;
    flex-wrap: wrap;
    align-items: center;
    gap: 0.4rem 0.8rem;
    margin-bottom: 0.4rem;
    font-size: 0.875rem;
  }
  .compare fieldset {
    display: flex;
    align-items: center;
    gap: 0.5rem;
    margin: 0;
  }
  .compare legend {
    float: left;
    width: auto;
    margin: 0;
  }
  .compare .segments label {
    padding: 0.25rem 0.7rem;
  }
  .summary {
    min-height: 1.45em;
    margin: 0.3rem 0 0;
  }
  .tabs {
    display: flex;
    flex-wrap: wrap;
    gap: 0.25rem;
    margin-bottom: -1px;
  }
  .tabs button {
    border-color: var(--line);
    border-radius: var(--radius) var(--radius) 0 0;
    color: var(--muted);
  }
  .tabs button[aria-selected="true"] {
    border-bottom-color: var(--panel);
    color: var(--text);
    font-weight: 600;
  }
  .tabs + .panel {
    border-top-left-radius: 0;
  }
  @media (max-width: 55.99rem) and (min-height: 34rem) {
    /* The picture stays in view above the controls: its own box must be that of all. */
    main {
      display: block;
    }
    .picture {
      display: contents;
    }
    .panel,
    .below {
      margin-top: var(--gap);
    }
    .below .panel {
      margin-top: 0;
    }
  }
  @media (min-width: 56rem) {
    main {
      grid-template-columns: minmax(0, 1fr) 20rem;
      gap: 1.25rem;
      align-items: start;
    }
    .controls {
      grid-column: 2;
      grid-row: 1 / span 4;
    }
    .below,
    .side,
    .picture {
      grid-column: 1;
    }
  }
  @media (min-width: 130rem) {
    main {
      grid-template-columns: minmax(0, 5fr) minmax(0, 4fr) 22rem;
    }
    .controls {
      grid-column: 3;
    }
    .side,
    .below {
      grid-column: 2;
    }
    .picture {
      grid-row: 1 / span 3;
    }
    .below {
      grid-row: 2;
    }
  }
`;

/// Texts typed into a component's fields that are no value. They stay as typed, each with its fault,
/// until they are one, or the value changes by whatever.
import type { ReactiveController, ReactiveControllerHost } from "lit";
import type { Field, FieldFaults } from "./faults.ts";
import type { PlaygroundState } from "./state.ts";

interface Host extends ReactiveControllerHost {
  readonly state: PlaygroundState;
  readonly faults: FieldFaults;
}

export class TypedTexts implements ReactiveController {
  private texts_: ReadonlyMap<Field, string> = new Map();
  private before_: PlaygroundState | undefined;

  constructor(private readonly host_: Host) {
    host_.addController(this);
  }

  hostUpdate(): void {
    const { state } = this.host_;
    const before = this.before_;
    this.before_ = state;
    if (before === undefined || this.texts_.size === 0) return;
    this.texts_ = new Map([...this.texts_].filter(([field]) => before[field] === state[field]));
  }

  keep(field: Field, text: string): void {
    this.texts_ = new Map(this.texts_).set(field, text);
    this.host_.requestUpdate();
  }

  drop(fields: readonly string[]): void {
    this.texts_ = new Map([...this.texts_].filter(([field]) => !fields.includes(field)));
    this.host_.requestUpdate();
  }

  text(field: Field): string | undefined {
    return this.texts_.get(field);
  }

  /// What is wrong with the field: its text, or what the server says of its value.
  faults(field: Field): readonly string[] {
    const text = this.texts_.get(field);
    return text === undefined ? (this.host_.faults.get(field) ?? []) : [`"${text}" is not a number`];
  }
}

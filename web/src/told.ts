/// What a task tells on its way, as a generator: the newest that was told, then its answer.
export async function* told<Progress, Answer>(
  task: (tell: (progress: Progress) => void) => Promise<Answer>,
): AsyncGenerator<Progress, Answer> {
  let newest: { progress: Progress } | undefined;
  let ended = false;
  let wake = (): void => undefined;
  const answer = task((progress) => {
    newest = { progress };
    wake();
  });
  const end = (): void => {
    ended = true;
    wake();
  };
  answer.then(end, end);
  for (;;) {
    if (newest) {
      const { progress } = newest;
      newest = undefined;
      yield progress;
    } else if (ended) return answer;
    else await new Promise<void>((resolve) => (wake = resolve));
  }
}

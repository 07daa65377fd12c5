"""A run of rtfmesh in a thread of its own, without Blender's data, which other threads must not touch."""

import threading

import rtfmesh


class Job:
    """A function that runs in the background: `work(progress)`, where `progress` is rtfmesh's callback."""

    def __init__(self, work):
        self.phase = "starting"
        self.fraction = 0.0
        self.result = None
        self.error = None
        self._work = work
        self._answer = None
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self):
        """Begins the run and returns at once."""
        self._thread.start()

    def cancel(self):
        """Asks the run to stop without a result."""
        self._answer = "cancel"

    def finish_early(self):
        """Asks the run to end soon, with a valid mesh."""
        self._answer = self._answer or "finish"

    def is_done(self):
        """Whether the thread has ended."""
        return not self._thread.is_alive()

    def wait(self):
        """The result, once it is there; raises what the run has raised."""
        self._thread.join()
        if self.error is not None:
            raise self.error
        return self.result

    def _run(self):
        try:
            self.result = self._work(self._told)
        # Whatever it is, it is shown to the user by the main thread.
        except BaseException as error:
            self.error = error
        # The run may have been past the last moment at which it could be stopped.
        if self._answer == "cancel" and self.error is None:
            self.result, self.error = None, rtfmesh.Cancelled("cancelled")

    def _told(self, progress):
        self.phase, self.fraction = progress.phase, progress.fraction
        return self._answer

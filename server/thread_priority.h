#pragma once

namespace fstop::server {

/// Adds `niceness` to the calling thread's own, and gives it the long time slices of work that
/// nobody waits for within milliseconds. Threads that it begins inherit both.
void make_this_thread_nice(int niceness);

/// Short time slices for the calling thread: woken, it takes the processor from a thread of longer
/// slices at once, not after that one's slice (Linux 6.12 and later, earlier ones change nothing).
/// Threads that it begins inherit them.
void make_this_thread_quick();

}  // namespace fstop::server

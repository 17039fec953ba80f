// What the sanitizers must not report: what happens inside libraries that are not instrumented.
// Linked into every test program.
extern "C" {

const char* __tsan_default_suppressions();
const char* __lsan_default_suppressions();

const char* __tsan_default_suppressions() {
  return "called_from_lib:libtbb.so\n"
         "called_from_lib:libembree3.so\n"
         // Its sinks are handed over by counts of references that the library itself takes.
         "race:spdlog::\n"
         // An exception that several replies share: libstdc++ counts its references in code that
         // is not instrumented, so that the last one's deletion seems not to come after the reads.
         "race:std::__exception_ptr::exception_ptr::_M_release\n"
         // Embree builds on threads of oneTBB; nothing of ours runs under it but its memory count.
         "race:libembree3.so\n"
         "race:fstop::RayScene::Acceleration\n";
}

// Both keep pools of their own until the process ends.
const char* __lsan_default_suppressions() { return "leak:libtbb.so\nleak:libOpenImageIO\n"; }
}

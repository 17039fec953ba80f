# Writes OUTPUT, a C++ source whose function FUNCTION, declared in HEADER, returns the text of INPUT.
# cmake -DINPUT=openapi.json -DOUTPUT=openapi.cpp -DHEADER=api/openapi.h -DFUNCTION=openapi_json -P embed.cmake
file(READ "${INPUT}" text)
string(FIND "${text}" ")json\"" end_mark)
if(NOT end_mark EQUAL -1)
  message(FATAL_ERROR "${INPUT} holds the end mark of the raw string it becomes")
endif()
file(WRITE "${OUTPUT}" "#include \"${HEADER}\"

namespace fstop::api {

std::string_view ${FUNCTION}() {
  static constexpr std::string_view kText = R\"json(")
file(APPEND "${OUTPUT}" "${text}")
file(APPEND "${OUTPUT}" ")json\";
  return kText;
}

}  // namespace fstop::api
")

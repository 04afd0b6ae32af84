// expect: ignoring returned value of type 'veneer::Status', declared with attribute 'nodiscard'
#include "base/result.h"

veneer::Status stop();

void wrong() { stop(); }

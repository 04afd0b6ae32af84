// expect: ignoring returned value of type 'veneer::Result<int>', declared with attribute 'nodiscard'
#include "base/result.h"

veneer::Result<int> count();

void wrong() { count(); }

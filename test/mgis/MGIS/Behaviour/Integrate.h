/* See Behaviour.h. */
#ifndef STAND_IN_MGIS_INTEGRATE_H
#define STAND_IN_MGIS_INTEGRATE_H
#include "MGIS/Behaviour/BehaviourDataView.h"
mgis_status mgis_bv_integrate(int *, mgis_bv_BehaviourDataView *, const mgis_bv_Behaviour *);
#endif

hal can eds check eds-value.eds

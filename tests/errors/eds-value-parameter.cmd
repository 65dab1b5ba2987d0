hal can eds check eds-value-parameter.eds
